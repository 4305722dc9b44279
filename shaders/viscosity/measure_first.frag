// Measure first: A f and A d, and texel by texel the scalar products that tell which mixture of f and d has least energy.
// u_u, u_v: f, the velocity before the viscous step; u_change_u, u_change_v: d, what the last step made of its own;
// u_right_u, u_right_v: the right-hand side b.
// Out: A f; A d; (b . f, b . d, f . A f, f . A d); d . A d.
// reads: 31
#include "viscosity/block.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_change_u;
uniform sampler2D u_change_v;
uniform sampler2D u_right_u;
uniform sampler2D u_right_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;
layout(location = 2) out vec4 out_change_u;
layout(location = 3) out vec4 out_change_v;
layout(location = 4) out vec4 out_products;
layout(location = 5) out float out_change_products;

void main() {
    Stiffness k = read_stiffness(v_uv);
    Faces f, af = apply_matrix(u_u, u_v, v_uv, k, f), d, ad = apply_matrix(u_change_u, u_change_v, v_uv, k, d);
    out_u = k.open_u * af.u;
    out_v = k.open_v * af.v;
    out_change_u = k.open_u * ad.u;
    out_change_v = k.open_v * ad.v;
    vec4 b_u = texture(u_right_u, v_uv), b_v = texture(u_right_v, v_uv);
    out_products = vec4(dot(b_u, f.u) + dot(b_v, f.v), dot(b_u, d.u) + dot(b_v, d.v),
                        dot(out_u, f.u) + dot(out_v, f.v), dot(out_u, d.u) + dot(out_v, d.v));
    out_change_products = dot(out_change_u, d.u) + dot(out_change_v, d.v);
}
