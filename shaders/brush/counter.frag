// Counter: a velocity of one direction under the brush, drawn with additive blending over MAC faces.
// v_vector: at the brush's centre, lengths / s.
// vertices: lib/images.vert
// reads: 0
#include "lib/brush.glsl"
uniform vec2 u_spacing;
flat in vec4 v_segment;
flat in vec2 v_vector;
layout(location = 0) out vec2 out_velocity;

void main() {
    vec2 u = (gl_FragCoord.xy - vec2(0.5, 0.0)) * u_spacing, v = (gl_FragCoord.xy - vec2(0.0, 0.5)) * u_spacing;
    out_velocity = v_vector * vec2(brush_weight(v_segment, u), brush_weight(v_segment, v)) * vec2(greaterThan(gl_FragCoord.xy, vec2(1.0)));
}
