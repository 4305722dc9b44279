// The wanted divergence of the fluid, gathered into blocks, and the fluid itself, to take the mean over.
// in:  u_source   wanted divergence at cells, 1 / s;  u_scale   h, lengths
//      u_left, u_up, u_far, u_span   faces
// out: h s at blocks, lengths / s; 1 where there is fluid that can flow
// reads: 7
#include "lib/block_faces.glsl"

uniform sampler2D u_source;
uniform float u_scale;

layout(location = 0) out vec4 out_source;
layout(location = 1) out vec4 out_live;

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_source, 0)), a = (2.0 * floor(gl_FragCoord.xy) + 0.5) * texel, b = a + texel;
    out_live = live(faces());
    out_source = u_scale * out_live * vec4(texture(u_source, a).r, texture(u_source, vec2(b.x, a.y)).r,
                                           texture(u_source, vec2(a.x, b.y)).r, texture(u_source, b).r);
}
