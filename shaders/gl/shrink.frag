// Shrink: one texel of the result from each square block, the largest value of each channel or their sum.
// u_field: any texels; its size need not be a multiple of a block's. u_side: texels along a block. Define SUM for the sum,
// else the largest.
// reads: 64
uniform sampler2D u_field;
uniform int u_side;
layout(location = 0) out vec4 out_value;

void main() {
    ivec2 corner = u_side * ivec2(gl_FragCoord.xy), end = min(corner + u_side, textureSize(u_field, 0));
#ifdef SUM
    out_value = vec4(0.0);
#else
    out_value = texelFetch(u_field, corner, 0);
#endif
    for (int y = corner.y; y < end.y; ++y)
        for (int x = corner.x; x < end.x; ++x) {
#ifdef SUM
            out_value += texelFetch(u_field, ivec2(x, y), 0);
#else
            out_value = max(out_value, texelFetch(u_field, ivec2(x, y), 0));
#endif
        }
}
