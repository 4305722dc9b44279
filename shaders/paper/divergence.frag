// Divergence at cell centres by central differences, times h, less the brushes' source.
// u_velocity: cell centres, lengths / s; u_source: 1 / s.
// reads: 5
#include "paper/collocated.glsl"
uniform sampler2D u_velocity;
uniform sampler2D u_source;
uniform float u_h;
layout(location = 0) out float out_divergence;

void main() {
    ivec2 c = ivec2(gl_FragCoord.xy);
    const ivec2 x = ivec2(1, 0), y = ivec2(0, 1);
    out_divergence = 0.5 * (velocity_at(u_velocity, c + x).x - velocity_at(u_velocity, c - x).x
                          + velocity_at(u_velocity, c + y).y - velocity_at(u_velocity, c - y).y)
                   - u_h * texelFetch(u_source, c, 0).r;
}
