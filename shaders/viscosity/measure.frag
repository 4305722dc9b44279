// Measure: A z and, texel by texel, the scalar products r . z, z . A z and z . s of the conjugate gradients.
// u_u, u_v: the new direction z; u_right_u, u_right_v: the residual r; u_stress_u, u_stress_v: s = A p of the direction
// before (FIRST: there is none).
// reads: 21
#include "viscosity/block.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_right_u;
uniform sampler2D u_right_v;
uniform sampler2D u_stress_u;
uniform sampler2D u_stress_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;
layout(location = 2) out vec4 out_products;

void main() {
    Stiffness k = read_stiffness(v_uv);
    Faces z, az = apply_matrix(u_u, u_v, v_uv, k, z);
    out_u = k.open_u * az.u;
    out_v = k.open_v * az.v;
    out_products = vec4(dot(texture(u_right_u, v_uv), z.u) + dot(texture(u_right_v, v_uv), z.v),
                        dot(out_u, z.u) + dot(out_v, z.v), 0.0, 0.0);
#ifndef FIRST
    out_products.z = dot(texture(u_stress_u, v_uv), z.u) + dot(texture(u_stress_v, v_uv), z.v);
#endif
}
