// Advect as the paper has it: w2(x) = decay w1(x - dt w1(x)), first-order backtrace, bilinear (section 3.2).
// u_velocity: cell centres, lengths / s; u_dt_over_h: dt / h.
// reads: 5
#include "paper/collocated.glsl"
uniform sampler2D u_velocity;
uniform float u_dt_over_h;
uniform float u_decay;
layout(location = 0) out vec2 out_velocity;

void main() {
    vec2 here = texelFetch(u_velocity, ivec2(gl_FragCoord.xy), 0).rg;
    out_velocity = u_decay * velocity_near(u_velocity, gl_FragCoord.xy - u_dt_over_h * here);
}
