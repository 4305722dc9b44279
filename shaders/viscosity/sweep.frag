// Sweep: one damped Jacobi sweep of both components, f + weight D^-1 (b - A f).
// u_u, u_v: the iterate f; u_right_u, u_right_v: the right-hand side b; u_weight: of the sweep (Chebyshev).
// reads: 19
#include "viscosity/block.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_right_u;
uniform sampler2D u_right_v;
uniform float u_weight;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    Stiffness k = read_stiffness(v_uv);
    Faces f, af = apply_matrix(u_u, u_v, v_uv, k, f), inverse = inverse_diagonal(k);
    out_u = f.u + u_weight * inverse.u * (texture(u_right_u, v_uv) - af.u);
    out_v = f.v + u_weight * inverse.v * (texture(u_right_v, v_uv) - af.v);
}
