// Smooth a mask under the brush: towards the mean of the 5 x 5 cells around.
// u_mask: the mask; u_strength: 0-1.
// reads: 26
#include "lib/brush.glsl"
uniform sampler2D u_mask;
uniform float u_strength;
uniform vec2 u_spacing;
in vec2 v_uv;
layout(location = 0) out float out_mask;

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_mask, 0));
    float sum = 0.0;
    for (int j = -2; j <= 2; ++j)
        for (int i = -2; i <= 2; ++i) sum += texture(u_mask, v_uv + vec2(i, j) * texel).r;
    out_mask = mix(texture(u_mask, v_uv).r, sum / 25.0, u_strength * brush_weight(gl_FragCoord.xy * u_spacing));
}
