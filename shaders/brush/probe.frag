// Probe: motion of the fluid at the end of each image of a brush, with what has been added to it for the next step: u, v
// (lengths / s), half the vorticity (1 / s, positive clockwise on the screen), viscosity (lengths^2 / s).
// u_velocity, u_impulse: MAC faces; u_viscosity: cells; u_at: the ends, cells; u_reach: half the distances that the
// rotation is measured over, cells; u_spacing: sides of a cell, lengths.
// reads: 84
#include "lib/mac.glsl"
#include "lib/between_cells.glsl"
#include "lib/images.glsl"
uniform sampler2D u_velocity;
uniform sampler2D u_impulse;
uniform sampler2D u_viscosity;
uniform vec2 u_at[MOST_IMAGES];
uniform vec2 u_reach;
uniform vec2 u_spacing;
layout(location = 0) out vec4 out_motion;

vec2 motion(vec2 p) { return mac_velocity(u_velocity, p) + mac_velocity(u_impulse, p); }

void main() {
    vec2 at = u_at[int(gl_FragCoord.x)];
    vec2 x = vec2(u_reach.x, 0.0), y = vec2(0.0, u_reach.y), over = 2.0 * u_reach * u_spacing;
    float vorticity = (motion(at + x).y - motion(at - x).y) / over.x - (motion(at + y).x - motion(at - y).x) / over.y;
    float viscosity = viscosity_at(u_viscosity, at);
    out_motion = vec4(motion(at), 0.5 * vorticity, viscosity);
}
