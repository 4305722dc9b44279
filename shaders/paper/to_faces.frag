// The paper's velocity, on the MAC faces that the overlays, the brushes and the density take: the mean of both sides.
// u_velocity: cell centres, lengths / s.
// reads: 3
#include "paper/collocated.glsl"
uniform sampler2D u_velocity;
layout(location = 0) out vec2 out_faces;

void main() {
    ivec2 c = ivec2(gl_FragCoord.xy);
    vec2 here = texelFetch(u_velocity, c, 0).rg;
    out_faces = 0.5 * (here + vec2(velocity_at(u_velocity, c - ivec2(1, 0)).x, velocity_at(u_velocity, c - ivec2(0, 1)).y));
}
