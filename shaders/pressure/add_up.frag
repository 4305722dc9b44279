// Sums over 8 x 8 texels each.
// in:  u_sums
// out: the same, 8 times smaller
// reads: 64
uniform sampler2D u_sums;

out vec2 out_sums;

void main() {
    ivec2 size = textureSize(u_sums, 0), start = 8 * ivec2(gl_FragCoord.xy), end = min(start + 8, size);
    out_sums = vec2(0.0);
    for (int y = start.y; y < end.y; y++)
        for (int x = start.x; x < end.x; x++) out_sums += texelFetch(u_sums, ivec2(x, y), 0).rg;
}
