// Smooth: one damped Jacobi sweep of both components, f + weight D^-1 (b - A f).
// u_u, u_v: the iterate f; u_rhs_u, u_rhs_v: the right-hand side b; u_weight: of the sweep (Chebyshev).
// reads: 21
#include "viscosity/operator.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_rhs_u;
uniform sampler2D u_rhs_v;
uniform float u_weight;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
#if !defined(UNIFORM) && !defined(COARSE)
    Stiffness k = read_stiffness(v_uv);
    vec2 s = u_shear * u_shear;
    Faces f, af = apply_operator(u_u, u_v, v_uv, k, f);
    // The diagonal follows from what has been read.
    Faces inverse = Faces(k.open_u / (1.0 + k.left + k.here_x + s.x * (k.node + k.node_below)),
                          k.open_v / (1.0 + k.above + k.here_y + s.y * (k.node + k.node_right)));
#else
    Faces f, is_open, af = apply_operator(u_u, u_v, v_uv, f, is_open), inverse = inverse_diagonal(v_uv);
#endif
    out_u = f.u + inverse.u * (u_weight * (texture(u_rhs_u, v_uv) - af.u));
    out_v = f.v + inverse.v * (u_weight * (texture(u_rhs_v, v_uv) - af.v));
}
