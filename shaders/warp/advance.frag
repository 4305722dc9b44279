// Advance: S'(x) = (x_d - x) + S(x_d), the submap's displacement carried one step by the fluid (characteristic mapping
// method, equation S4 of solver/README.md; paper section 4.1, eq. (5) without diffusion); x + S'(x) stays in the grid.
// u_displacement (S): cell centres, longer sides; u_spacing: sides of a cell, longer sides; u_images: see lib/displacement.glsl; u_trace: x_d - x, cells.
// With INNER the grid is a window, and over the last FADING cells before a side that is not the picture's edge (1 in
// u_inner: left, right, top, bottom) it is carried less and less, so that there is no step in the map at the side.
// With TRACE the trace is not given but drawn beside it, for the fluid's next step: inputs of step/trace.frag.
// reads: 13, and 23 with TRACE, 47 in two halves
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
uniform vec4 u_images;
layout(location = 0) out vec2 out_displacement;

#ifdef INNER
uniform vec4 u_inner;
const float FADING = 4.0;
float carried(vec2 p, vec2 size) {
    vec4 fade = mix(vec4(1.0), smoothstep(0.0, FADING, vec4(p, size - p).xzyw), u_inner);
    return fade.x * fade.y * fade.z * fade.w;
}
#else
float carried(vec2 p, vec2 size) { return 1.0; }
#endif

void main() {
    vec2 p = gl_FragCoord.xy, size = vec2(textureSize(u_displacement, 0));
#ifdef TRACE
    vec2 back = mac_trace(u_velocity, p, u_cells_a_speed);
    out_trace = back;
#else
    vec2 back = texture(u_trace, v_uv).rg;
#endif
    back *= carried(p, size);
    vec2 displacement = back + cubic_displacement(u_displacement, p + back, u_images) / u_spacing;
    out_displacement = u_spacing * clamp(displacement, -p, size - p);
}
