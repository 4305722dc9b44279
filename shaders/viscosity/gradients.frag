// Gradients: the two factors of a step of flexible conjugate gradients, after the first; a texel for each step.
// u_products: sums of r . z, z . A z and z . alpha_before A p_before, a few texels; u_before: the texels of the steps before; u_step: this one's.
// p = z + beta p_before with p . A p_before = 0, and alpha the way along p to the least energy; with s = A p_before:
// beta = -z.s / p_before.s, p.Ap = z.Az - (z.s)^2 / p_before.s, alpha = r.z / p.Ap.
// Out: (alpha, beta, p.Ap, 0). A step that rounding has spoiled is not taken.
// reads: 26
uniform sampler2D u_products;
uniform sampler2D u_before;
uniform int u_step;
layout(location = 0) out vec4 out_factors;

void main() {
    int step = int(gl_FragCoord.x);
    if (step != u_step) {
        out_factors = texelFetch(u_before, ivec2(step, 0), 0);
        return;
    }
    ivec2 size = textureSize(u_products, 0);
    vec3 sum = vec3(0.0);
    for (int j = 0; j < size.y; ++j)
        for (int i = 0; i < size.x; ++i) sum += texelFetch(u_products, ivec2(i, j), 0).xyz;
    float rz = sum.x, curvature = sum.y, beta = 0.0;
    vec4 before = texelFetch(u_before, ivec2(step - 1, 0), 0);
    if (before.x != 0.0) {
        float zs = sum.z / before.x;
        beta = -zs / before.z;
        curvature += beta * zs;
    }
    bool sound = curvature > 1e-6 * sum.y && sum.y < 1e37 && abs(rz) < 1e37;
    out_factors = sound ? vec4(rz / curvature, beta, curvature, 0.0) : vec4(0.0);
}
