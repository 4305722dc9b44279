// Gradients: the two factors of a step of conjugate gradients (Chronopoulos and Gear 1989), on one texel.
// u_products: sums of r . z and z . A z, a few texels; u_before: this texel of the step before (FIRST: there is none).
// beta = rz / rz_before, alpha = rz / (z.Az - beta rz / alpha_before); out: (alpha, beta, rz, 0).
// A step that rounding has spoiled is not taken.
// reads: 26
uniform sampler2D u_products;
uniform sampler2D u_before;
layout(location = 0) out vec4 out_factors;

void main() {
    ivec2 size = textureSize(u_products, 0);
    vec2 sum = vec2(0.0);
    for (int j = 0; j < size.y; ++j)
        for (int i = 0; i < size.x; ++i) sum += texelFetch(u_products, ivec2(i, j), 0).rg;
    float rz = sum.x, curvature = sum.y, beta = 0.0;
#ifndef FIRST
    vec4 before = texelFetch(u_before, ivec2(0), 0);
    if (before.x > 0.0 && before.z > 0.0) {
        beta = rz / before.z;
        curvature -= beta * rz / before.x;
    }
#endif
    bool sound = rz > 0.0 && curvature > 0.0 && rz < 1e37;
    out_factors = sound ? vec4(rz / curvature, beta, rz, 0.0) : vec4(0.0);
}
