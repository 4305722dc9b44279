// Trace: for every cell centre, how far back the fluid there came from in one step: d = x_d - x, in cells.
// u_velocity: MAC faces, lengths / s; u_cells_a_speed: dt / spacing. Second-order backtrace (equation S3).
// reads: 11, and 35 in two halves
#include "lib/mac.glsl"
uniform sampler2D u_velocity;
uniform vec2 u_cells_a_speed;
layout(location = 0) out vec2 out_displacement;

void main() {
    out_displacement = mac_trace(u_velocity, gl_FragCoord.xy, u_cells_a_speed);
}
