// Change: what the viscous step has made of v*, x - v*, from which the next step's first guess is made.
// u_x_u, u_x_v: x; u_u, u_v: v*.
// reads: 4
uniform sampler2D u_x_u;
uniform sampler2D u_x_v;
uniform sampler2D u_u;
uniform sampler2D u_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    out_u = texture(u_x_u, v_uv) - texture(u_u, v_uv);
    out_v = texture(u_x_v, v_uv) - texture(u_v, v_uv);
}
