// A sweep of damped Jacobi on a graph:  p += 0.8 (A p - r) / (sum of links). The eigenvalues of that matrix lie between 0
// and 2, so no error grows, and 0.8 leaves at most 0.6 of those with eigenvalues from 1/2 on.
// in:  u_pressure   p, none with FROM_ZERO (p = 0);  u_residual   r;  u_rows, u_links of pressure/graph.glsl
// out: p
// reads: 12
#include "pressure/graph.glsl"

uniform sampler2D u_pressure;
uniform sampler2D u_residual;
uniform sampler2D u_rows;
uniform sampler2D u_links;

out vec4 out_pressure;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    vec4 row = texelFetch(u_rows, place, 0);
    float here = 0.0, applied = 0.0;
#ifndef FROM_ZERO
    here = texelFetch(u_pressure, place, 0).r;
    applied = laplacian(u_pressure, u_links, row, here);
#endif
    float change = row.y > 0.0 ? 0.8 * (applied - texelFetch(u_residual, place, 0).r) / row.z : 0.0;
    out_pressure = vec4(here + change);
}
