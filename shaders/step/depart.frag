// Depart: what is to be advected, w1 = w0 + dt f less what is carried with it, from two cells before the grid to two
// behind it, so that it can be read four by four.
// u_velocity (w0), u_carried: MAC faces, lengths / s. With FORCE: u_force, MAC faces, u_impulse times which is dt f.
// Only far enough from the edges that the cell is not beyond one or on it; with EDGES anywhere.
// reads: 3, and 6 with EDGES
#ifdef EDGES
#include "lib/walls.glsl"
#endif
uniform sampler2D u_velocity;
uniform sampler2D u_carried;
#ifdef FORCE
uniform sampler2D u_force;
uniform float u_impulse;
#endif
layout(location = 0) out vec2 out_departing;

vec2 departing(vec2 cell, vec2 texel) {
    vec2 place = (cell + 0.5) * texel, sum = texture(u_velocity, place).rg - texture(u_carried, place).rg;
#ifdef FORCE
    sum += u_impulse * texture(u_force, place).rg;
#endif
    return sum;
}

#ifdef EDGES
vec2 at(vec2 cell, vec2 size) {
    float sign_u, sign_u_across, added_u, sign_v, sign_v_across, added_v;
    vec2 image_u = vec2(image_normal(cell.x, size.x, sign_u),
                        image_tangential(cell.y, size.y, u_wall_speed.zw, sign_u_across, added_u));
    vec2 image_v = vec2(image_tangential(cell.x, size.x, u_wall_speed.xy, sign_v_across, added_v),
                        image_normal(cell.y, size.y, sign_v));
    vec2 texel = 1.0 / size;
    return vec2(sign_u * (sign_u_across * departing(image_u, texel).x + added_u),
                sign_v * (sign_v_across * departing(image_v, texel).y + added_v));
}
#else
vec2 at(vec2 cell, vec2 size) { return departing(cell, 1.0 / size); }
#endif

void main() {
    vec2 cell = floor(gl_FragCoord.xy) - 2.0, size = vec2(textureSize(u_velocity, 0));
    out_departing = at(cell, size);
}
