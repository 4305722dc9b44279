// Expand: bloat or pinch, a divergence source under the brush, 1 / s, drawn with additive blending.
// v_vector.x: the source at the centre of an image, 1 / s; negative pinches.
// vertices: lib/images.vert
// reads: 0
#include "lib/brush.glsl"
uniform vec2 u_spacing;
flat in vec4 v_segment;
flat in vec2 v_vector;
layout(location = 0) out float out_source;

void main() {
    out_source = v_vector.x * brush_weight(v_segment, gl_FragCoord.xy * u_spacing);
}
