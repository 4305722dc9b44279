// Measure: A z and, texel by texel, the scalar products r . z, z . A z and z . alpha A p of the conjugate gradients.
// u_u, u_v: the new way z; u_right_u, u_right_v: the residual r; u_before_u, u_before_v: r before the last step, which
// went along p: r_before - r = alpha A p, so that A p itself need not be kept.
// reads: 21
#include "viscosity/block.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_right_u;
uniform sampler2D u_right_v;
uniform sampler2D u_before_u;
uniform sampler2D u_before_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;
layout(location = 2) out vec4 out_products;

void main() {
    Stiffness k = read_stiffness(v_uv);
    Faces z, az = apply_matrix(u_u, u_v, v_uv, k, z);
    out_u = k.open_u * az.u;
    out_v = k.open_v * az.v;
    vec4 r_u = texture(u_right_u, v_uv), r_v = texture(u_right_v, v_uv);
    out_products = vec4(dot(r_u, z.u) + dot(r_v, z.v), dot(out_u, z.u) + dot(out_v, z.v),
                        dot(texture(u_before_u, v_uv) - r_u, z.u) + dot(texture(u_before_v, v_uv) - r_v, z.v), 0.0);
}
