// Update: x + alpha p and r - alpha A p along a search direction, and with NEXT the direction itself first:
// p = z + beta p_before, A p = A z + beta A p_before.
// u_x_u, u_x_v: x; u_r_u, u_r_v: r; u_p_u, u_p_v, u_ap_u, u_ap_v: p and A p, with NEXT those of the step before;
// u_z_u, u_z_v, u_az_u, u_az_v: z and A z; u_alpha, u_beta.
// reads: 12
uniform sampler2D u_x_u;
uniform sampler2D u_x_v;
uniform sampler2D u_r_u;
uniform sampler2D u_r_v;
uniform sampler2D u_p_u;
uniform sampler2D u_p_v;
uniform sampler2D u_ap_u;
uniform sampler2D u_ap_v;
uniform sampler2D u_z_u;
uniform sampler2D u_z_v;
uniform sampler2D u_az_u;
uniform sampler2D u_az_v;
uniform float u_alpha;
uniform float u_beta;
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
    out_p_u = texture(u_z_u, v_uv) + u_beta * texture(u_p_u, v_uv);
    out_p_v = texture(u_z_v, v_uv) + u_beta * texture(u_p_v, v_uv);
    out_ap_u = texture(u_az_u, v_uv) + u_beta * texture(u_ap_u, v_uv);
    out_ap_v = texture(u_az_v, v_uv) + u_beta * texture(u_ap_v, v_uv);
    out_x_u = texture(u_x_u, v_uv) + u_alpha * out_p_u;
    out_x_v = texture(u_x_v, v_uv) + u_alpha * out_p_v;
    out_r_u = texture(u_r_u, v_uv) - u_alpha * out_ap_u;
    out_r_v = texture(u_r_v, v_uv) - u_alpha * out_ap_v;
}
