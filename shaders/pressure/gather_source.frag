// The wanted divergence of the fluid, gathered into blocks, and what its mean over the fluid follows from.
// in:  u_source   wanted divergence at cells, 1 / s;  u_scale   h, lengths
//      u_left, u_up, u_far, u_span   faces
// out: h s at blocks, lengths / s;  sums over the block: R of h s, G of the cells of fluid that can flow
// reads: 7
#include "lib/block_faces.glsl"

uniform sampler2D u_source;
uniform float u_scale;

layout(location = 0) out vec4 out_source;
layout(location = 1) out vec4 out_sums;

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_source, 0)), a = (2.0 * floor(gl_FragCoord.xy) + 0.5) * texel, b = a + texel;
    vec4 flowing = live(faces());
    out_source = u_scale * flowing * vec4(texture(u_source, a).r, texture(u_source, vec2(b.x, a.y)).r,
                                           texture(u_source, vec2(a.x, b.y)).r, texture(u_source, b).r);
    out_sums = vec4(dot(out_source, vec4(1.0)), dot(flowing, vec4(1.0)), 0.0, 0.0);
}
