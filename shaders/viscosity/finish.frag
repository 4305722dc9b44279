// Finish: the last update of x alone, x + alpha p with p = z + beta p_before, and the change x - v* that the viscous step
// has made, of which the next one's first guess is made.
// u_x_u, u_x_v: x; u_z_u, u_z_v: z; u_p_u, u_p_v: p_before; u_u, u_v: v*; u_alpha, u_beta.
// reads: 8
uniform sampler2D u_x_u;
uniform sampler2D u_x_v;
uniform sampler2D u_z_u;
uniform sampler2D u_z_v;
uniform sampler2D u_p_u;
uniform sampler2D u_p_v;
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform float u_alpha;
uniform float u_beta;
in vec2 v_uv;
layout(location = 0) out vec4 out_x_u;
layout(location = 1) out vec4 out_x_v;
layout(location = 2) out vec4 out_u;
layout(location = 3) out vec4 out_v;

void main() {
    out_x_u = texture(u_x_u, v_uv) + u_alpha * (texture(u_z_u, v_uv) + u_beta * texture(u_p_u, v_uv));
    out_x_v = texture(u_x_v, v_uv) + u_alpha * (texture(u_z_v, v_uv) + u_beta * texture(u_p_v, v_uv));
    out_u = out_x_u - texture(u_u, v_uv);
    out_v = out_x_v - texture(u_v, v_uv);
}
