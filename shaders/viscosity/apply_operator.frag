// Apply operator: A z and, texel by texel, the scalar products of the conjugate gradients.
// Inputs: see iterate.glsl, z the preconditioned residual; u_r_u, u_r_v: the residual r; not with FIRST u_ap_u, u_ap_v: A p
// of the last search direction p.
// Out: A z; (r . z, z . A z, z . A p, x . x), with UNIFORM without the last.
// reads: 26
#include "viscosity/operator.glsl"
#include "viscosity/iterate.glsl"
uniform sampler2D u_r_u;
uniform sampler2D u_r_v;
uniform sampler2D u_ap_u;
uniform sampler2D u_ap_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;
layout(location = 2) out vec4 out_products;

void main() {
    Faces z, is_open, az = apply_operator(u_z_u, u_z_v, v_uv, z, is_open);
    out_u = is_open.u * az.u;
    out_v = is_open.v * az.v;
    out_products = vec4(dot(texture(u_r_u, v_uv), z.u) + dot(texture(u_r_v, v_uv), z.v),
                        dot(out_u, z.u) + dot(out_v, z.v), 0.0, 0.0);
#ifndef FIRST
    out_products.z = dot(texture(u_ap_u, v_uv), z.u) + dot(texture(u_ap_v, v_uv), z.v);
#endif
#ifndef UNIFORM
    vec4 x_u = iterate_u(v_uv), x_v = iterate_v(v_uv);
    out_products.w = dot(x_u, x_u) + dot(x_v, x_v);
#endif
}
