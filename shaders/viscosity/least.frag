// Least: how much of f and of d makes the mixture of least energy, p = x f + y d with p . A p - 2 b . p least.
// u_products: sums of (b . f, b . d, f . A f, f . A d), u_change_products: of d . A d, a few texels each.
// Out: the first texel of gradients.frag's factors: (alpha, x, p . A p, y), alpha being 1, or 0 if p is nothing.
// reads: 40
uniform sampler2D u_products;
uniform sampler2D u_change_products;
layout(location = 0) out vec4 out_factors;

void main() {
    ivec2 size = textureSize(u_products, 0);
    vec4 sum = vec4(0.0);
    float change = 0.0;
    for (int j = 0; j < size.y; ++j)
        for (int i = 0; i < size.x; ++i) {
            sum += texelFetch(u_products, ivec2(i, j), 0);
            change += texelFetch(u_change_products, ivec2(i, j), 0).r;
        }
    // Along f; then along what of d is conjugate to f, unless rounding has spoiled it or nothing is left.
    bool is_moving = sum.z > 0.0 && sum.z < 1e37 && abs(sum.x) < 1e37;
    float x = is_moving ? sum.x / sum.z : 0.0, beta = is_moving ? sum.w / sum.z : 0.0, y = 0.0;
    float curvature = change - beta * sum.w;
    if (curvature > 1e-5 * change && change < 1e37 && abs(sum.y) < 1e37) y = (sum.y - beta * sum.x) / curvature;
    x -= beta * y;
    float energy = x * sum.x + y * sum.y;
    out_factors = energy > 0.0 && energy < 1e37 ? vec4(1.0, x, energy, y) : vec4(0.0);
}
