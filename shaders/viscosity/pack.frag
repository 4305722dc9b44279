// Pack: the textures of block.glsl from the cells of cells.glsl, and what walls make of the nodes they touch.
// A wall node's shear is nil at free-slip walls; at no-slip ones (NO_SLIP) a face beyond it stands still at the node,
// half a cell away, which doubles K; at a convex corner the resting face is a whole cell away, and K stays.
// reads: 16
#include "viscosity/cells.glsl"
layout(location = 0) out vec4 out_cells_x;
layout(location = 1) out vec4 out_cells_y;
layout(location = 2) out vec4 out_nodes;
layout(location = 3) out vec4 out_cell_halo;
layout(location = 4) out vec4 out_node_halo;
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
// The sign says whether the face is open; a K of nothing keeps its sign too.
float marked(float k, bool open) { return open ? k : -max(k, 1e-30); }

void main() {
    ivec2 corner = 2 * (ivec2(gl_FragCoord.xy) - 1);
    for (int q = 0; q < 16; ++q) around[q] = cell(corner + ivec2(q % 4 - 1, q / 4 - 1));
    for (int q = 0; q < 4; ++q) {
        int i = q % 2, j = q / 2;
        vec4 here = at(i, j);
        out_cells_x[q] = marked(here.r, left_open(here));
        out_cells_y[q] = here.g;
        out_nodes[q] = marked(node(i, j), upper_open(here));
        out_open[q] = here.a;
    }
    out_cell_halo = vec4(at(-1, 0).r, at(-1, 1).r, at(0, -1).g, at(1, -1).g);
    out_node_halo = vec4(node(2, 0), node(2, 1), node(0, 2), node(1, 2));
}
