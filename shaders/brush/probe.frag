// Probe: motion of the fluid at each image of a brush, with what has been added to it for the next step: u, v (lengths / s),
// half the vorticity (1 / s, positive clockwise on the screen), viscosity (lengths^2 / s). Row 0 has it where the images' paths
// end, row 1 where they begin.
// u_velocity, u_impulse: MAC faces; u_viscosity: cells; u_ends: begin.xy, end.xy of each path, cells; u_reach: half the
// distances that the rotation is measured over, cells; u_spacing: sides of a cell, lengths.
// reads: 84
#include "lib/mac.glsl"
#include "lib/between_cells.glsl"
#include "lib/images.glsl"
uniform sampler2D u_velocity;
uniform sampler2D u_impulse;
uniform sampler2D u_viscosity;
uniform vec4 u_ends[MOST_IMAGES];
uniform vec2 u_reach;
uniform vec2 u_spacing;
layout(location = 0) out vec4 out_motion;

vec2 motion(vec2 p) { return mac_velocity(u_velocity, p) + mac_velocity(u_impulse, p); }

void main() {
    vec4 ends = u_ends[int(gl_FragCoord.x)];
    vec2 at = gl_FragCoord.y < 1.0 ? ends.zw : ends.xy;
    vec2 x = vec2(u_reach.x, 0.0), y = vec2(0.0, u_reach.y), over = 2.0 * u_reach * u_spacing;
    float vorticity = (motion(at + x).y - motion(at - x).y) / over.x - (motion(at + y).x - motion(at - y).x) / over.y;
    float viscosity = viscosity_at(u_viscosity, at);
    out_motion = vec4(motion(at), 0.5 * vorticity, viscosity);
}
