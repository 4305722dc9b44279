// Advance: D'(x) = (x_d - x) + D(x_d), the map's displacement carried one step by the fluid (numerics: characteristic
// mapping method; paper section 4.1, eq. (5) without diffusion).
// u_displacement: cell centres, longer sides; u_h: side of a cell, longer sides; u_trace: x_d - x, cells, or with
// VELOCITY what that follows from: u_velocity, MAC faces, lengths / s, and u_dt_over_h.
// reads: 23
#include "lib/displacement.glsl"
#include "lib/mac.glsl"
uniform sampler2D u_displacement;
uniform sampler2D u_trace;
uniform sampler2D u_velocity;
uniform float u_dt_over_h;
uniform float u_h;
in vec2 v_uv;
layout(location = 0) out vec2 out_displacement;

void main() {
    vec2 p = gl_FragCoord.xy;
#ifdef VELOCITY
    vec2 back = mac_backtrace(u_velocity, p, mac_centre(u_velocity, p), u_dt_over_h) - p;
#else
    vec2 back = texture(u_trace, v_uv).rg;
#endif
    out_displacement = back * u_h + cubic_displacement(u_displacement, p + back);
}
