// Trace: for every cell centre, how far back the fluid there came from in one step: d = x_d - x, in cells.
// u_velocity: MAC faces, lengths / s; u_dt_over_h: dt / h. Second-order backtrace.
// reads: 11
#include "lib/mac.glsl"
uniform sampler2D u_velocity;
uniform float u_dt_over_h;
layout(location = 0) out vec2 out_displacement;

void main() {
    out_displacement = mac_trace(u_velocity, gl_FragCoord.xy, u_dt_over_h);
}
