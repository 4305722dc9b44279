// The coarse level's correction, added to all cells that a coarse unknown stands for: the transpose of restrict.frag.
// in:  u_pressure   p at blocks;  u_coarse   p of the coarser level
// With GRAPH the coarser level is a graph: u_parents, the unknowns of a block's four cells, -1 where there is none.
// out: p at blocks
// reads: 6
#include "pressure/graph.glsl"

uniform sampler2D u_pressure;
uniform sampler2D u_coarse;
uniform sampler2D u_parents;

in vec2 v_uv;
out vec4 out_pressure;

void main() {
    out_pressure = texture(u_pressure, v_uv);
#ifdef GRAPH
    vec4 parents = texture(u_parents, v_uv);
    for (int k = 0; k < 4; k++)
        if (parents[k] >= 0.0) out_pressure[k] += at(u_coarse, parents[k]).r;
#else
    vec2 cell = floor(gl_FragCoord.xy), block = floor(0.5 * cell), side = cell - 2.0 * block;
    vec4 mine = vec2(1.0 - side.x, side.x).xyxy * vec2(1.0 - side.y, side.y).xxyy;
    out_pressure += dot(texture(u_coarse, (block + 0.5) / vec2(textureSize(u_coarse, 0))), mine);
#endif
}
