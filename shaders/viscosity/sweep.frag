// Sweep: one damped Jacobi sweep of both components, f + weight D^-1 (b - A f), less `taken` D^-1 b.
// u_u, u_v: the iterate f; u_right_u, u_right_v: the right-hand side b; u_weight: of the sweep (Chebyshev); u_taken.
// reads: 19
#include "viscosity/block.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_right_u;
uniform sampler2D u_right_v;
uniform float u_weight;
uniform float u_taken;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    Stiffness k = read_stiffness(v_uv);
    Faces f, af = apply_matrix(u_u, u_v, v_uv, k, f), inverse = inverse_diagonal(k);
    vec4 right_u = texture(u_right_u, v_uv), right_v = texture(u_right_v, v_uv);
    out_u = f.u + inverse.u * (u_weight * (right_u - af.u) - u_taken * right_u);
    out_v = f.v + inverse.v * (u_weight * (right_v - af.v) - u_taken * right_v);
}
