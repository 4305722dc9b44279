// Probe: velocity and rotation of the fluid at one point, into a single texel: u, v (lengths / s), half the vorticity
// (1 / s, positive clockwise on the screen), 0.
// u_velocity: MAC faces; u_at: the point, cells; u_reach: half the distance the rotation is measured over, cells.
// reads: 40
#include "lib/mac.glsl"
uniform sampler2D u_velocity;
uniform vec2 u_at;
uniform float u_reach;
uniform float u_h;
layout(location = 0) out vec4 out_motion;

void main() {
    vec2 x = vec2(u_reach, 0.0), y = vec2(0.0, u_reach);
    float curl = mac_velocity(u_velocity, u_at + x).y - mac_velocity(u_velocity, u_at - x).y
               - mac_velocity(u_velocity, u_at + y).x + mac_velocity(u_velocity, u_at - y).x;
    out_motion = vec4(mac_velocity(u_velocity, u_at), 0.25 * curl / (u_reach * u_h), 0.0);
}
