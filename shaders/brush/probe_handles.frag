// Probe handles: the fluid at places out of a list, with what has been added to it for the next step, a texel each: u, v
// (lengths / s); the part that a brush may do there (see obstruct.frag); viscosity (lengths^2 / s).
// u_handles: x, y (from the grid's corner) and the brush's radius, lengths; u_velocity, u_impulse: MAC faces;
// u_viscosity, u_solid: cells; u_spacing: sides of a cell, lengths.
// reads: 213
#include "lib/mac.glsl"
#include "lib/crowding.glsl"
uniform sampler2D u_handles;
uniform sampler2D u_velocity;
uniform sampler2D u_impulse;
uniform sampler2D u_viscosity;
uniform sampler2D u_solid;
uniform vec2 u_spacing;
layout(location = 0) out vec4 out_found;

void main() {
    vec3 handle = texelFetch(u_handles, ivec2(gl_FragCoord.xy), 0).rgb;
    vec2 at = handle.xy / u_spacing;
    float viscosity = viscosity_at(u_viscosity, at);
    float part = uncrowded(crowding(u_viscosity, u_solid, handle.xy, handle.z, viscosity, u_spacing));
    out_found = vec4(mac_velocity(u_velocity, at) + mac_velocity(u_impulse, at), part, viscosity);
}
