// Thicken: what a brush adds to the painted thickness, or takes from it, drawn with blending.
// u_amount: where the brush is full, in 65535ths of the texel's range.
// vertices: lib/images.vert
// reads: 0
#include "lib/brush.glsl"
uniform float u_amount;
uniform vec2 u_spacing;
flat in vec4 v_segment;
layout(location = 0) out float out_thickness;

void main() { out_thickness = u_amount * brush_weight(v_segment, gl_FragCoord.xy * u_spacing); }
