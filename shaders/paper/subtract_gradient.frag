// w4 = w3 - grad q by central differences; solid cells do not move.
// u_velocity: cell centres, lengths / s; u_pressure: lengths^2 / s.
// reads: 6
#include "paper/collocated.glsl"
uniform sampler2D u_velocity;
uniform sampler2D u_pressure;
uniform sampler2D u_solid;
uniform float u_h;
layout(location = 0) out vec2 out_velocity;

void main() {
    ivec2 c = ivec2(gl_FragCoord.xy);
    const ivec2 x = ivec2(1, 0), y = ivec2(0, 1);
    vec2 gradient = 0.5 / u_h * vec2(scalar_at(u_pressure, c + x) - scalar_at(u_pressure, c - x),
                                     scalar_at(u_pressure, c + y) - scalar_at(u_pressure, c - y));
    vec2 velocity = texelFetch(u_velocity, c, 0).rg - gradient;
    out_velocity = texelFetch(u_solid, c, 0).r > 0.5 ? vec2(0.0) : velocity;
}
