// Expand: bloat or pinch, a divergence source under the brush, 1 / s, drawn with additive blending.
// u_rate: the source at the brush's centre, 1 / s; negative pinches.
// reads: 0
#include "lib/brush.glsl"
uniform float u_rate;
uniform vec2 u_spacing;
layout(location = 0) out float out_source;

void main() {
    out_source = u_rate * brush_weight(gl_FragCoord.xy * u_spacing);
}
