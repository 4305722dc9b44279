// Twirl: make the fluid under the brush turn at a rate, drawn with additive blending: dv = gain domega b(r) (-y, x).
// u_motion: the fluid's motion at the brush, from probe; u_rate: wanted rotation, rad / s, positive clockwise.
// reads: 1, and 10 when ATTENUATED
#include "lib/brush.glsl"
#include "lib/attenuation.glsl"
uniform sampler2D u_motion;
uniform float u_rate;
uniform float u_gain;
uniform vec2 u_spacing;
layout(location = 0) out vec2 out_velocity;

vec2 spin(vec2 cell, float rate, float viscosity) {
    vec2 r = cell * u_spacing - u_segment.zw;
    return rate * brush_falloff(length(r)) * vec2(-r.y, r.x) * attenuation(cell, viscosity);
}

void main() {
    vec2 cell = floor(gl_FragCoord.xy);
    vec4 motion = texelFetch(u_motion, ivec2(0), 0);
    float rate = u_gain * unobstructed() * (u_rate > 0.0 ? max(u_rate - motion.z, 0.0) : min(u_rate - motion.z, 0.0));
    vec2 velocity = vec2(spin(cell + vec2(0.0, 0.5), rate, motion.w).x, spin(cell + vec2(0.5, 0.0), rate, motion.w).y);
    out_velocity = velocity * vec2(greaterThan(cell, vec2(0.5)));
}
