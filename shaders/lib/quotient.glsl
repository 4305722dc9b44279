// The quotient of the two sums that dot_products.frag and add_up.frag left in one texel; 0 where there is nothing.
float quotient(sampler2D sums) {
    vec2 s = texelFetch(sums, ivec2(0), 0).rg;
    return s.y > 0.0 ? s.x / s.y : 0.0;
}
