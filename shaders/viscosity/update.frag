// Update: the search direction p and A p, x + alpha p and r - alpha A p.
// Inputs: see iterate.glsl; u_r_u, u_r_v: r; u_az_u, u_az_v: A z; not with FIRST u_ap_u, u_ap_v: A p_before; u_alpha.
// reads: 12
#include "viscosity/iterate.glsl"
uniform sampler2D u_r_u;
uniform sampler2D u_r_v;
uniform sampler2D u_ap_u;
uniform sampler2D u_ap_v;
uniform sampler2D u_az_u;
uniform sampler2D u_az_v;
uniform float u_alpha;
in vec2 v_uv;
layout(location = 0) out vec4 out_x_u;
layout(location = 1) out vec4 out_x_v;
layout(location = 2) out vec4 out_r_u;
layout(location = 3) out vec4 out_r_v;
layout(location = 4) out vec4 out_p_u;
layout(location = 5) out vec4 out_p_v;
layout(location = 6) out vec4 out_ap_u;
layout(location = 7) out vec4 out_ap_v;

void main() {
    out_p_u = direction_u(v_uv);
    out_p_v = direction_v(v_uv);
    out_ap_u = texture(u_az_u, v_uv);
    out_ap_v = texture(u_az_v, v_uv);
#ifndef FIRST
    out_ap_u += u_beta * texture(u_ap_u, v_uv);
    out_ap_v += u_beta * texture(u_ap_v, v_uv);
#endif
    out_x_u = iterate_u(v_uv) + u_alpha * out_p_u;
    out_x_v = iterate_v(v_uv) + u_alpha * out_p_v;
    out_r_u = texture(u_r_u, v_uv) - u_alpha * out_ap_u;
    out_r_v = texture(u_r_v, v_uv) - u_alpha * out_ap_v;
}
