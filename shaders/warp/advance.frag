// Advance: S'(x) = (x_d - x) + S(x_d), the submap's displacement carried one step by the fluid (characteristic mapping
// method, equation S4 of solver/README.md; paper section 4.1, eq. (5) without diffusion); x + S'(x) stays in the picture.
// u_displacement (S): cell centres, longer sides; u_spacing: sides of a cell, longer sides; u_trace: x_d - x, cells.
// With TRACE the trace is not given but drawn beside it, for the fluid's next step: inputs of step/trace.frag.
// reads: 13, and 23 with TRACE
#include "lib/displacement.glsl"
#ifdef TRACE
#include "lib/mac.glsl"
uniform sampler2D u_velocity;
uniform vec2 u_cells_a_speed;
layout(location = 1) out vec2 out_trace;
#else
uniform sampler2D u_trace;
in vec2 v_uv;
#endif
uniform sampler2D u_displacement;
uniform vec2 u_spacing;
layout(location = 0) out vec2 out_displacement;

void main() {
    vec2 p = gl_FragCoord.xy, size = vec2(textureSize(u_displacement, 0));
#ifdef TRACE
    vec2 back = mac_trace(u_velocity, p, u_cells_a_speed);
    out_trace = back;
#else
    vec2 back = texture(u_trace, v_uv).rg;
#endif
    vec2 displacement = back + cubic_displacement(u_displacement, p + back) / u_spacing;
    out_displacement = u_spacing * clamp(displacement, -p, size - p);
}
