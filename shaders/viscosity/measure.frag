// Measure: A z and, texel by texel, the two scalar products r . z and z . A z of the conjugate gradients.
// u_u, u_v: the preconditioned residual z; u_right_u, u_right_v: the residual r.
// reads: 21
#include "viscosity/block.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_right_u;
uniform sampler2D u_right_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;
layout(location = 2) out vec2 out_products;

void main() {
    Faces z, az = apply_matrix(u_u, u_v, v_uv, read_stiffness(v_uv), z), inverse = inverse_diagonal(v_uv);
    out_u = open(inverse.u) * az.u;
    out_v = open(inverse.v) * az.v;
    out_products = vec2(dot(texture(u_right_u, v_uv), z.u) + dot(texture(u_right_v, v_uv), z.v),
                        dot(out_u, z.u) + dot(out_v, z.v));
}
