// Pack the cells: the textures of block.glsl from the cells of cells.glsl, and what walls make of the nodes they touch.
// A wall node's shear is nil at free-slip walls; at no-slip ones (NO_SLIP) a face beyond it stands still at the node,
// half a cell away, which doubles K; at a convex corner the resting face is a whole cell away, and K stays.
// reads: 16
#include "viscosity/cells.glsl"
layout(location = 0) out vec4 out_cells_x;
layout(location = 1) out vec4 out_cells_y;
layout(location = 2) out vec4 out_nodes;
layout(location = 3) out vec4 out_inverse_u;
layout(location = 4) out vec4 out_inverse_v;
layout(location = 5) out vec4 out_open;

vec4 around[16]; // cells -1..2 by rows, 0 the upper left one of the texel

vec4 at(int i, int j) { return around[4 * (j + 1) + i + 1]; }

float node(int i, int j) {
    float open = float(left_open(at(i, j))) + float(left_open(at(i, j - 1)))
               + float(upper_open(at(i, j))) + float(upper_open(at(i - 1, j)));
#ifdef NO_SLIP
    return at(i, j).b * (open < 1.5 ? 2.0 : 1.0);
#else
    return open > 3.5 ? at(i, j).b : 0.0;
#endif
}
void main() {
    ivec2 corner = 2 * (ivec2(gl_FragCoord.xy) - 1);
    for (int q = 0; q < 16; ++q) around[q] = cell(corner + ivec2(q % 4 - 1, q / 4 - 1));
    vec4 n, open;
    for (int q = 0; q < 4; ++q) {
        int i = q % 2, j = q / 2;
        vec4 here = at(i, j);
        out_cells_x[q] = here.r;
        out_cells_y[q] = here.g;
        open[q] = here.a;
        n[q] = node(i, j);
    }
    vec2 right = vec2(node(2, 0), node(2, 1)), below = vec2(node(0, 2), node(1, 2));
    vec4 cells = vec4(at(-1, 0).r, at(-1, 1).r, at(0, -1).g, at(1, -1).g);
    out_open = open / 255.0;
    vec4 open_u = mod(open, 2.0), open_v = step(1.5, open);
    // A node that resists nothing still tells an open face by its sign.
    const float least = 1e-30;
    out_nodes = mix(-n - least, max(n, least), open_v);
    vec4 x = out_cells_x, y = out_cells_y;
    out_cells_x = mix(-x, x, open_u);
    out_inverse_u = open_u / (1.0 + vec4(cells.x, x.x, cells.y, x.z) + x + n + vec4(n.zw, below));
    out_inverse_v = open_v / (1.0 + vec4(cells.zw, y.xy) + y + n + vec4(n.y, right.x, n.w, right.y));
}
