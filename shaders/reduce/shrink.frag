// Shrink: one texel of the result from each block of 4 x 4, the largest value of each channel or their sum.
// u_field: any texels; its size need not be a multiple of 4. Define SUM for the sum, else the largest.
// reads: 16
uniform sampler2D u_field;
layout(location = 0) out vec4 out_value;

void main() {
    ivec2 corner = 4 * ivec2(gl_FragCoord.xy), last = textureSize(u_field, 0) - 1;
#ifdef SUM
    out_value = vec4(0.0);
#else
    out_value = texelFetch(u_field, corner, 0);
#endif
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
            ivec2 place = corner + ivec2(i, j);
#ifdef SUM
            // Beyond the edge there is nothing to add.
            out_value += all(lessThanEqual(place, last)) ? texelFetch(u_field, place, 0) : vec4(0.0);
#else
            out_value = max(out_value, texelFetch(u_field, min(place, last), 0));
#endif
        }
}
