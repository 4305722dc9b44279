// Galerkin guess: A f and A d, and texel by texel the scalar products that tell which a f + b d has least energy.
// u_u, u_v: f, the velocity before the viscous step; u_change_u, u_change_v: d, what the last step made of its own;
// u_rhs_u, u_rhs_v: the right-hand side b.
// Out: A f; A d; (b . f, b . d, f . A f, f . A d); d . A d.
// reads: 38
#include "viscosity/operator.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_change_u;
uniform sampler2D u_change_v;
uniform sampler2D u_rhs_u;
uniform sampler2D u_rhs_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;
layout(location = 2) out vec4 out_change_u;
layout(location = 3) out vec4 out_change_v;
layout(location = 4) out vec4 out_products;
layout(location = 5) out float out_change_product;

void main() {
    Stiffness k = read_stiffness(v_uv);
    Faces f, d;
    Faces af = apply_operator(u_u, u_v, v_uv, k, f), ad = apply_operator(u_change_u, u_change_v, v_uv, k, d);
    out_u = k.open_u * af.u;
    out_v = k.open_v * af.v;
    out_change_u = k.open_u * ad.u;
    out_change_v = k.open_v * ad.v;
    vec4 b_u = texture(u_rhs_u, v_uv), b_v = texture(u_rhs_v, v_uv);
    out_products = vec4(dot(b_u, f.u) + dot(b_v, f.v), dot(b_u, d.u) + dot(b_v, d.v),
                        dot(out_u, f.u) + dot(out_v, f.v), dot(out_u, d.u) + dot(out_v, d.v));
    out_change_product = dot(out_change_u, d.u) + dot(out_change_v, d.v);
}
