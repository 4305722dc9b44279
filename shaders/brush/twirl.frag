// Twirl: make the fluid under the brush turn at a rate, drawn with additive blending: dv = domega g(r) (-y, x).
// u_motion: the fluid's motion at the brush, from probe; u_rate: wanted rotation, rad / s, positive clockwise.
// reads: 1
#include "lib/brush.glsl"
uniform sampler2D u_motion;
uniform float u_rate;
uniform float u_h;
layout(location = 0) out vec2 out_velocity;

vec2 spin(vec2 x, float rate) {
    vec2 r = x - u_segment.zw;
    return rate * brush_falloff(length(r)) * vec2(-r.y, r.x);
}

void main() {
    vec2 cell = floor(gl_FragCoord.xy);
    float have = texelFetch(u_motion, ivec2(0), 0).z;
    float rate = u_rate > 0.0 ? max(u_rate - have, 0.0) : min(u_rate - have, 0.0);
    vec2 velocity = vec2(spin((cell + vec2(0.0, 0.5)) * u_h, rate).x, spin((cell + vec2(0.5, 0.0)) * u_h, rate).y);
    out_velocity = velocity * vec2(greaterThan(cell, vec2(0.5)));
}
