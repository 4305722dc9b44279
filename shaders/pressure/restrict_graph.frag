// Right-hand side of a coarser graph: what is left of the residual, r - A p, summed over each unknown's finer ones.
// in:  u_pressure, u_residual   p and r of the finer graph;  u_rows, u_links of pressure/graph.glsl of the finer one
//      u_children   of each coarser unknown: the first of its finer ones, and their number
// out: right-hand side
// reads: 44
#include "pressure/graph.glsl"

uniform sampler2D u_pressure;
uniform sampler2D u_residual;
uniform sampler2D u_rows;
uniform sampler2D u_links;
uniform sampler2D u_children;

out vec4 out_residual;

void main() {
    vec2 children = texelFetch(u_children, ivec2(gl_FragCoord.xy), 0).xy;
    float sum = 0.0;
    for (float k = children.x; k < children.x + children.y; k++)
        sum += at(u_residual, k).r - laplacian(u_pressure, u_links, at(u_rows, k), at(u_pressure, k).r);
    out_residual = vec4(sum);
}
