// Begin: the first guess x = a f + c d of galerkin_guess.frag, A x, and the residual b - A x.
// u_u, u_v: f; u_change_u, u_change_v: d; u_af_u, u_af_v, u_ad_u, u_ad_v: A f and A d; u_rhs_u, u_rhs_v: b; u_parts: (a, c).
// Out: x; A x; b - A x.
// reads: 10
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_change_u;
uniform sampler2D u_change_v;
uniform sampler2D u_af_u;
uniform sampler2D u_af_v;
uniform sampler2D u_ad_u;
uniform sampler2D u_ad_v;
uniform sampler2D u_rhs_u;
uniform sampler2D u_rhs_v;
uniform vec2 u_parts;
in vec2 v_uv;
layout(location = 0) out vec4 out_x_u;
layout(location = 1) out vec4 out_x_v;
layout(location = 2) out vec4 out_ax_u;
layout(location = 3) out vec4 out_ax_v;
layout(location = 4) out vec4 out_r_u;
layout(location = 5) out vec4 out_r_v;

void main() {
    out_x_u = u_parts.x * texture(u_u, v_uv) + u_parts.y * texture(u_change_u, v_uv);
    out_x_v = u_parts.x * texture(u_v, v_uv) + u_parts.y * texture(u_change_v, v_uv);
    out_ax_u = u_parts.x * texture(u_af_u, v_uv) + u_parts.y * texture(u_ad_u, v_uv);
    out_ax_v = u_parts.x * texture(u_af_v, v_uv) + u_parts.y * texture(u_ad_v, v_uv);
    out_r_u = texture(u_rhs_u, v_uv) - out_ax_u;
    out_r_v = texture(u_rhs_v, v_uv) - out_ax_v;
}
