// Add force on the paper's grid: dt times the mean of the forces on opposite faces, drawn with additive blending.
// u_force: MAC faces, lengths / s^2; u_impulse: seconds.
// reads: 3
#include "lib/mac.glsl"
uniform sampler2D u_force;
uniform float u_impulse;
layout(location = 0) out vec2 out_velocity;

void main() {
    out_velocity = u_impulse * mac_centre(u_force, gl_FragCoord.xy);
}
