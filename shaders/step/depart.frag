// Depart: w1 = w0 - g + dt f (equation S2; paper section 3.2, first stage), laid out so that six texels hold the 4 x 4 faces
// of any cubic: texel (i + 2, k + 1) holds 2 x 2 faces, of columns i and i + 1, rows 2k and 2k + 1. It reaches as far beyond
// the walls as the cubic does, with images of the faces inside. Only where no face is on a wall or beyond one; with EDGES
// anywhere.
// u_velocity (w0), with CARRIED u_carried (g, half of what pressure did last): MAC faces, lengths / s. With FORCE: u_force,
// MAC faces, lengths / s^2, and u_impulse, the force's time law integrated over the tick, seconds.
// reads: 12
#ifdef EDGES
#include "lib/walls.glsl"
#endif
uniform sampler2D u_velocity;
uniform sampler2D u_carried;
uniform sampler2D u_force;
uniform float u_impulse;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

vec2 advected_velocity(vec2 place) {
    vec2 w = texture(u_velocity, place).rg;
#ifdef CARRIED
    w -= texture(u_carried, place).rg;
#endif
#ifdef FORCE
    w += u_impulse * texture(u_force, place).rg;
#endif
    return w;
}

#ifdef EDGES
vec2 face(vec2 cell, vec2 size) {
    float sign_u, sign_u_across, added_u, sign_v, sign_v_across, added_v;
    vec2 image_u = vec2(image_normal(cell.x, size.x, sign_u),
                        image_tangential(cell.y, size.y, u_wall_image.zw, u_wall_speed.zw, sign_u_across, added_u));
    vec2 image_v = vec2(image_tangential(cell.x, size.x, u_wall_image.xy, u_wall_speed.xy, sign_v_across, added_v),
                        image_normal(cell.y, size.y, sign_v));
    return vec2(sign_u * (sign_u_across * advected_velocity((image_u + 0.5) / size).x + added_u),
                sign_v * (sign_v_across * advected_velocity((image_v + 0.5) / size).y + added_v));
}
#else
vec2 face(vec2 cell, vec2 size) { return advected_velocity((cell + 0.5) / size); }
#endif

void main() {
    vec2 cell = vec2(1.0, 2.0) * floor(gl_FragCoord.xy) - 2.0, size = vec2(textureSize(u_velocity, 0));
    vec2 a = face(cell, size), b = face(cell + vec2(1.0, 0.0), size), c = face(cell + vec2(0.0, 1.0), size), d = face(cell + 1.0, size);
    out_u = vec4(a.x, b.x, c.x, d.x);
    out_v = vec4(a.y, b.y, c.y, d.y);
}
