// What coarsen_nodes.frag and coarsen_line.frag share: K of the fine nodes around the texel's four coarse ones, and the
// couplings that are kept.
// u_node0 ... u_node4: of the finer level, as in stress.frag, on the finest u_node0 only; u_open: of the coarse one;
// u_alone: see restrict.frag.
#include "viscosity/openness.glsl"
#include "viscosity/sides.glsl"
#include "viscosity/fine_level.glsl"
uniform vec2 u_alone;
uniform sampler2D u_node0;
uniform sampler2D u_node1;
uniform sampler2D u_node2;
uniform sampler2D u_node3;
uniform sampler2D u_node4;
layout(location = 0) out vec4 out_node0;
layout(location = 1) out vec4 out_node1;
layout(location = 2) out vec4 out_node2;
layout(location = 3) out vec4 out_node3;
layout(location = 4) out vec4 out_node4;

vec4 around[12]; // texels, row by row, from the one before and above the first coarse node's

void read(sampler2D nodes) {
    for (int q = 0; q < 12; ++q) around[q] = fine(nodes, fine_texel() + ivec2(q % 4 - 1, q / 4 - 1));
}

// K of the fine nodes so many rows and columns from the texel's four coarse ones.
vec4 at(int row, int column) {
    int first = 4 * ((row + 2) / 2) + (column + 2) / 2, place = 2 * ((row + 2) % 2) + (column + 2) % 2;
    return vec4(around[first][place], around[first + 1][place], around[first + 4][place], around[first + 5][place]);
}

// Whether all four faces at a texel's nodes move, or the fluid sticks there: a free-slip wall has no shear.
vec4 moving(vec2 texel) {
    vec4 u = open_u(texel), above = open_u(texel - vec2(0.0, 1.0)), v = open_v(texel), left = open_v(texel - vec2(1.0, 0.0));
    vec4 stuck = sticks(2.0 * texel.x + vec4(0.0, 1.0, 0.0, 1.0), 2.0 * texel.y + vec4(0.0, 0.0, 1.0, 1.0));
    return max(u * vec4(above.zw, u.xy) * v * vec4(left.y, v.x, left.w, v.z), stuck);
}

// The couplings of nodes that have a shear, times `part`.
void keep(vec4 n0, vec4 n1, vec4 n2, vec4 n3, vec4 n4, float part) {
    vec2 texel = own_texel(), x = vec2(1.0, 0.0), y = vec2(0.0, 1.0);
    vec4 here = moving(texel), right = moving(texel + x), below = moving(texel + y), corner = moving(texel + x + y);
    vec4 before = moving(texel - x + y), left = moving(texel - x);
    n0 *= here;
    n1 *= here * vec4(here.y, right.x, here.w, right.z);
    n2 *= here * vec4(here.zw, below.xy);
    n3 *= here * vec4(here.w, right.z, below.y, corner.x);
    n4 *= here * vec4(left.w, here.z, before.y, below.x);
    out_node0 = part * n0;
    out_node1 = part * n1;
    out_node2 = part * n2;
    out_node3 = part * n3;
    out_node4 = part * n4;
}
