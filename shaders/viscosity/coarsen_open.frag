// Coarsen: which faces of the next coarser level are open: those beside which all the fine ones are, so that a correction
// never pushes through a wall. u_open: of the finer level, packed as in operator.glsl; u_alone: see restrict.frag.
// reads: 8
#include "viscosity/openness.glsl"
uniform vec2 u_alone;
layout(location = 0) out vec4 out_open;

void main() {
    // A coarse cell lies over each of these texels.
    vec2 first = 2.0 * own_texel();
    vec4 found_u, found_v;
    for (int q = 0; q < 4; ++q) {
        vec2 at = first + vec2(q % 2, q / 2);
        vec4 u = open_u(at), v = open_v(at), left = open_u(at - vec2(1.0, 0.0)), above = open_v(at - vec2(0.0, 1.0));
        u.zw = max(u.zw, u_alone.y - 1.0);
        left.w = max(left.w, u_alone.y - 1.0);
        v.yw = max(v.yw, u_alone.x - 1.0);
        above.w = max(above.w, u_alone.x - 1.0);
        found_u[q] = u.x * u.y * u.z * u.w * left.y * left.w;
        found_v[q] = v.x * v.y * v.z * v.w * above.z * above.w;
    }
    out_open = (found_u + 2.0 * found_v) / 255.0;
}
