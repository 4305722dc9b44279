// One Jacobi sweep of lap q = div w3 (paper section 3.2, fourth stage).
// u_pressure: the iterate, lengths^2 / s; u_divergence: times h.
// reads: 5
#include "paper/collocated.glsl"
uniform sampler2D u_pressure;
uniform sampler2D u_divergence;
uniform float u_h;
layout(location = 0) out float out_pressure;

void main() {
    ivec2 c = ivec2(gl_FragCoord.xy);
    const ivec2 x = ivec2(1, 0), y = ivec2(0, 1);
    out_pressure = 0.25 * (scalar_at(u_pressure, c - x) + scalar_at(u_pressure, c + x) + scalar_at(u_pressure, c - y)
                         + scalar_at(u_pressure, c + y) - u_h * texelFetch(u_divergence, c, 0).r);
}
