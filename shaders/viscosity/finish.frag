// Finish: the last update of x alone, x + alpha p, and the change x - v* that the viscous step has made, of which the next
// one's first guess is made. Inputs: see iterate.glsl; u_alpha.
// reads: 8
#include "viscosity/iterate.glsl"
uniform float u_alpha;
in vec2 v_uv;
layout(location = 0) out vec4 out_x_u;
layout(location = 1) out vec4 out_x_v;
layout(location = 2) out vec4 out_change_u;
layout(location = 3) out vec4 out_change_v;

void main() {
    out_x_u = iterate_u(v_uv) + u_alpha * direction_u(v_uv);
    out_x_v = iterate_v(v_uv) + u_alpha * direction_v(v_uv);
    out_change_u = out_x_u - texture(u_u, v_uv);
    out_change_v = out_x_v - texture(u_v, v_uv);
}
