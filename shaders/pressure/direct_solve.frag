// The coarsest graph, solved: its right-hand side times the inverse of its matrix, worked out on the CPU.
// in:  u_residual   right-hand side;  u_inverse   the matrix, four columns a texel;  u_count   of unknowns
// out: p
// reads: 640
#include "pressure/graph.glsl"

uniform sampler2D u_residual;
uniform sampler2D u_inverse;
uniform int u_count;

out vec4 out_pressure;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    int row = place.x + WIDTH * place.y;
    float sum = 0.0;
    if (row < u_count)
        for (int k = 0; k < u_count; k += 4) {
            ivec2 from = ivec2(k % WIDTH, k / WIDTH);
            sum += dot(texelFetch(u_inverse, ivec2(k / 4, row), 0),
                       vec4(texelFetch(u_residual, from, 0).r, texelFetch(u_residual, from + ivec2(1, 0), 0).r,
                            texelFetch(u_residual, from + ivec2(2, 0), 0).r, texelFetch(u_residual, from + ivec2(3, 0), 0).r));
        }
    out_pressure = vec4(sum);
}
