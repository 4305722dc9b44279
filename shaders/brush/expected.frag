// Expected: what expect.frag has drawn in a window, taken over where the rest is.
// u_expected: of the same size.
// reads: 1
uniform sampler2D u_expected;
layout(location = 0) out float out_expected;

void main() { out_expected = texelFetch(u_expected, ivec2(gl_FragCoord.xy), 0).r; }
