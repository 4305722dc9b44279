// The scalar products a . b and b . b over 8 x 8 blocks each.
// in:  u_a, u_b   at blocks
// out: R a . b, G b . b
// reads: 128
uniform sampler2D u_a;
uniform sampler2D u_b;

out vec2 out_sums;

void main() {
    ivec2 size = textureSize(u_a, 0), start = 8 * ivec2(gl_FragCoord.xy), end = min(start + 8, size);
    out_sums = vec2(0.0);
    for (int y = start.y; y < end.y; y++)
        for (int x = start.x; x < end.x; x++) {
            vec4 a = texelFetch(u_a, ivec2(x, y), 0), b = texelFetch(u_b, ivec2(x, y), 0);
            out_sums += vec2(dot(a, b), dot(b, b));
        }
}
