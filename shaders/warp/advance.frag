// Advance: D'(x) = (x_d - x) + D(x_d), the map's displacement carried one step by the fluid (numerics: characteristic
// mapping method; paper section 4.1, eq. (5) without diffusion).
// u_displacement: cell centres, longer sides; u_h: side of a cell, longer sides; u_trace: x_d - x, cells.
// reads: 13
#include "lib/displacement.glsl"
uniform sampler2D u_displacement;
uniform sampler2D u_trace;
uniform float u_h;
in vec2 v_uv;
layout(location = 0) out vec2 out_displacement;

void main() {
    vec2 back = texture(u_trace, v_uv).rg;
    out_displacement = back * u_h + cubic_displacement(u_displacement, gl_FragCoord.xy + back);
}
