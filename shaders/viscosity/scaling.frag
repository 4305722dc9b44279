// Scaling: the part alpha of v* that has least energy, b . b / b . A v*, at most 1; one texel.
// u_products: sums of (b . b, b . A v*), a few texels.
// reads: 20
uniform sampler2D u_products;
layout(location = 0) out float out_part;

void main() {
    ivec2 size = textureSize(u_products, 0);
    vec2 sum = vec2(0.0);
    for (int j = 0; j < size.y; ++j)
        for (int i = 0; i < size.x; ++i) sum += texelFetch(u_products, ivec2(i, j), 0).xy;
    bool is_sound = sum.y > 0.0 && sum.y < 1e37 && sum.x < 1e37;
    out_part = is_sound ? min(sum.x / sum.y, 1.0) : 0.0;
}
