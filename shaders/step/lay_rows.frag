// Lay rows: what departs, four faces of a row a texel, so that the cubic reads a row at once: texel (i + 1, j + 2) holds
// faces i - 1 to i + 2 of row j. It reaches as far beyond the walls as the cubic does, with images of the faces inside.
// u_velocity (w1): MAC faces, lengths / s. Only far enough from the edges that no face is beyond one; with EDGES anywhere.
// reads: 4
#ifdef EDGES
#include "lib/walls.glsl"
#endif
uniform sampler2D u_velocity;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

#ifdef EDGES
vec2 face(vec2 cell, vec2 size) {
    float sign_u, sign_u_across, added_u, sign_v, sign_v_across, added_v;
    vec2 image_u = vec2(image_normal(cell.x, size.x, sign_u),
                        image_tangential(cell.y, size.y, u_wall_image.zw, u_wall_speed.zw, sign_u_across, added_u));
    vec2 image_v = vec2(image_tangential(cell.x, size.x, u_wall_image.xy, u_wall_speed.xy, sign_v_across, added_v),
                        image_normal(cell.y, size.y, sign_v));
    return vec2(sign_u * (sign_u_across * texture(u_velocity, (image_u + 0.5) / size).r + added_u),
                sign_v * (sign_v_across * texture(u_velocity, (image_v + 0.5) / size).g + added_v));
}
#else
vec2 face(vec2 cell, vec2 size) { return texture(u_velocity, (cell + 0.5) / size).rg; }
#endif

void main() {
    vec2 cell = floor(gl_FragCoord.xy) - vec2(1.0, 2.0), size = vec2(textureSize(u_velocity, 0)), x = vec2(1.0, 0.0);
    vec2 a = face(cell - x, size), b = face(cell, size), c = face(cell + x, size), d = face(cell + 2.0 * x, size);
    out_u = vec4(a.x, b.x, c.x, d.x);
    out_v = vec4(a.y, b.y, c.y, d.y);
}
