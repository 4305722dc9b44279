// The coarsest level, solved: its right-hand side times the pseudo-inverse of its matrix, worked out on the CPU.
// in:  u_residual   right-hand side at blocks
//      u_inverse    row = block of the solution, columns 4 k to 4 k + 3 = the cells of block k of the right-hand side;
//                   a texel holds the row's four cells
// out: pressure / h at blocks
// reads: 320
uniform sampler2D u_residual;
uniform sampler2D u_inverse;

out vec4 out_pressure;

void main() {
    ivec2 size = textureSize(u_residual, 0), here = ivec2(gl_FragCoord.xy);
    int row = here.y * size.x + here.x, column = 0;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < size.y; y++)
        for (int x = 0; x < size.x; x++) {
            vec4 r = texelFetch(u_residual, ivec2(x, y), 0);
            sum += r.x * texelFetch(u_inverse, ivec2(column, row), 0) + r.y * texelFetch(u_inverse, ivec2(column + 1, row), 0)
                 + r.z * texelFetch(u_inverse, ivec2(column + 2, row), 0) + r.w * texelFetch(u_inverse, ivec2(column + 3, row), 0);
            column += 4;
        }
    out_pressure = sum;
}
