// The correction of a coarser graph, added to the unknowns of the finer one: the transpose of restrict_graph.frag.
// in:  u_pressure   p;  u_rows   of pressure/graph.glsl;  u_coarse   p of the coarser graph
// out: p
// reads: 3
#include "pressure/graph.glsl"

uniform sampler2D u_pressure;
uniform sampler2D u_rows;
uniform sampler2D u_coarse;

out vec4 out_pressure;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    float parent = texelFetch(u_rows, place, 0).w;
    out_pressure = texelFetch(u_pressure, place, 0) + (parent < 0.0 ? 0.0 : at(u_coarse, parent).r);
}
