// Right-hand side of the coarser level: what is left of the residual, r - A p, summed over each coarse unknown's cells.
// in:  u_pressure, u_residual   p and r at blocks of the finer level;  links of lib/block.glsl of the finer level
// With GRAPH the coarser level is a graph: u_cells, for each unknown the block of its cells, (x, y), and which they are,
// the sum of 1, 2, 4, 8 for x, y, z, w.
// out: right-hand side of the coarser level, at blocks or unknowns
// reads: 36
#include "lib/block.glsl"

uniform sampler2D u_pressure;
uniform sampler2D u_residual;
uniform sampler2D u_cells;

out vec4 out_residual;

vec4 left_of(vec2 block) {
    vec2 uv = (block + 0.5) / vec2(textureSize(u_pressure, 0));
    return texture(u_residual, uv) - laplacian(u_pressure, uv, texture(u_pressure, uv), links_of(block, uv));
}

#ifdef GRAPH
void main() {
    vec3 cells = texelFetch(u_cells, ivec2(gl_FragCoord.xy), 0).xyz;
    int bits = int(cells.z);
    out_residual = vec4(dot(left_of(cells.xy), vec4(bits & 1, (bits >> 1) & 1, (bits >> 2) & 1, (bits >> 3) & 1)));
}
#else
// The coarser level is padded to an even number of cells.
float total(vec2 block) {
    return dot(left_of(block), vec4(all(lessThan(block, vec2(textureSize(u_pressure, 0))))));
}

void main() {
    vec2 a = 2.0 * floor(gl_FragCoord.xy), b = a + 1.0;
    out_residual = vec4(total(a), total(vec2(b.x, a.y)), total(vec2(a.x, b.y)), total(b));
}
#endif
