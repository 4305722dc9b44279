// Direct solve: the solution on the coarsest level, the inverse matrix times the right-hand side.
// u_rhs_u, u_rhs_v: the right-hand side b; u_inverse: A^-1, a row for each unknown, four columns a texel, the unknowns
// in the order of the texels, all u before all v.
// reads: 216
uniform sampler2D u_rhs_u;
uniform sampler2D u_rhs_v;
uniform sampler2D u_inverse;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    ivec2 size = textureSize(u_rhs_u, 0) - 2, here = ivec2(gl_FragCoord.xy) - 1;
    int count = size.x * size.y, row = 4 * (here.y * size.x + here.x);
    out_u = out_v = vec4(0.0);
    for (int t = 0; t < count; ++t) {
        ivec2 place = ivec2(t % size.x, t / size.x) + 1;
        vec4 u = texelFetch(u_rhs_u, place, 0), v = texelFetch(u_rhs_v, place, 0);
        for (int q = 0; q < 4; ++q) {
            out_u[q] += dot(texelFetch(u_inverse, ivec2(t, row + q), 0), u)
                      + dot(texelFetch(u_inverse, ivec2(t + count, row + q), 0), v);
            out_v[q] += dot(texelFetch(u_inverse, ivec2(t, row + q + 4 * count), 0), u)
                      + dot(texelFetch(u_inverse, ivec2(t + count, row + q + 4 * count), 0), v);
        }
    }
}
