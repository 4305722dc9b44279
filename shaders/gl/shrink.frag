// Shrink: one texel of the result from each square block, the largest value of each channel or their sum.
// u_field: any texels; its size need not be a multiple of a block's. u_side: texels along a block. Define SUM for the sum,
// else the largest.
// reads: 64
uniform sampler2D u_field;
uniform float u_side;
layout(location = 0) out vec4 out_value;

void main() {
    vec2 size = vec2(textureSize(u_field, 0)), texel = 1.0 / size;
    vec2 first = u_side * floor(gl_FragCoord.xy) + 0.5, end = min(first + u_side - 0.5, size);
#ifdef SUM
    out_value = vec4(0.0);
#else
    out_value = texture(u_field, first * texel);
#endif
    for (float y = first.y; y < end.y; ++y)
        for (float x = first.x; x < end.x; ++x) {
            vec4 value = texture(u_field, vec2(x, y) * texel);
#ifdef SUM
            out_value += value;
#else
            out_value = max(out_value, value);
#endif
        }
}
