// Advance: D'(x) = (x_d - x) + D(x_d), the map's displacement carried one step by the fluid (numerics: characteristic
// mapping method; paper section 4.1, eq. (5) without diffusion).
// u_displacement: cell centres, longer sides; u_h: side of a cell, longer sides; u_trace: x_d - x, cells.
// With TRACE it is drawn too, as a second output, as step/trace.frag does: u_velocity, u_dt_over_h.
// reads: 13, and 23 with TRACE
#include "lib/displacement.glsl"
#ifdef TRACE
#include "lib/mac.glsl"
uniform sampler2D u_velocity;
uniform float u_dt_over_h;
layout(location = 1) out vec2 out_trace;
#else
uniform sampler2D u_trace;
#endif
uniform sampler2D u_displacement;
uniform float u_h;
in vec2 v_uv;
layout(location = 0) out vec2 out_displacement;

void main() {
#ifdef TRACE
    vec2 back = out_trace = mac_trace(u_velocity, gl_FragCoord.xy, u_dt_over_h);
#else
    vec2 back = texture(u_trace, v_uv).rg;
#endif
    out_displacement = back * u_h + cubic_displacement(u_displacement, gl_FragCoord.xy + back);
}
