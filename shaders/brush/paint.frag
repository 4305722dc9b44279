// Paint a mask: move its value by an amount, or towards a value, under the brush.
// u_mask: the mask; u_more: added where the brush is full; u_mix, u_towards: the part that goes to that value instead;
// u_limits: the smallest and largest value it may take.
// reads: 1
#include "lib/brush.glsl"
uniform sampler2D u_mask;
uniform float u_more;
uniform float u_mix;
uniform float u_towards;
uniform vec2 u_limits;
uniform vec2 u_spacing;
in vec2 v_uv;
layout(location = 0) out float out_mask;

void main() {
    float w = brush_weight(gl_FragCoord.xy * u_spacing);
    float value = texture(u_mask, v_uv).r;
    out_mask = clamp(mix(value + w * u_more, u_towards, w * u_mix), u_limits.x, u_limits.y);
}
