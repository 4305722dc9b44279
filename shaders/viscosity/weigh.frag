// Weigh: texel by texel, the scalar products b . b and b . A v*, by which gradients.frag tells which part of v* to keep.
// u_u, u_v: the right-hand side b; u_r_u, u_r_v: the residual b - A v*.
// reads: 4
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_r_u;
uniform sampler2D u_r_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_products;

void main() {
    vec4 u = texture(u_u, v_uv), v = texture(u_v, v_uv);
    float wanted = dot(u, u) + dot(v, v);
    out_products = vec4(wanted, wanted - dot(u, texture(u_r_u, v_uv)) - dot(v, texture(u_r_v, v_uv)), 0.0, 0.0);
}
