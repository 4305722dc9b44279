// Counter: a velocity of one direction under the brush, drawn with additive blending over MAC faces.
// u_speed: at the brush's centre, lengths / s.
// reads: 0
#include "lib/brush.glsl"
uniform vec2 u_speed;
uniform vec2 u_spacing;
layout(location = 0) out vec2 out_velocity;

void main() {
    vec2 u = (gl_FragCoord.xy - vec2(0.5, 0.0)) * u_spacing, v = (gl_FragCoord.xy - vec2(0.0, 0.5)) * u_spacing;
    out_velocity = u_speed * vec2(brush_weight(u), brush_weight(v)) * vec2(greaterThan(gl_FragCoord.xy, vec2(1.0)));
}
