// Advance: S'(x) = (x_d - x) + S(x_d), the submap's displacement carried one step by the fluid (characteristic mapping
// method, equation S4 of solver/README.md; paper section 4.1, eq. (5) without diffusion); x + S'(x) stays in the picture.
// u_displacement (S): cell centres, longer sides; u_spacing: sides of a cell, longer sides; u_trace: x_d - x, cells.
// reads: 13
#include "lib/displacement.glsl"
uniform sampler2D u_displacement;
uniform sampler2D u_trace;
uniform vec2 u_spacing;
in vec2 v_uv;
layout(location = 0) out vec2 out_displacement;

void main() {
    vec2 back = texture(u_trace, v_uv).rg, p = gl_FragCoord.xy, size = vec2(textureSize(u_displacement, 0));
    vec2 displacement = back + cubic_displacement(u_displacement, p + back) / u_spacing;
    out_displacement = u_spacing * clamp(displacement, -p, size - p);
}
