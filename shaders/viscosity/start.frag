// Start: the first damped Jacobi sweep, from rest: f = weight D^-1 b.
// u_rhs_u, u_rhs_v: the right-hand side b; u_weight: of the sweep.
// reads: 4
#include "viscosity/operator.glsl"
uniform sampler2D u_rhs_u;
uniform sampler2D u_rhs_v;
uniform float u_weight;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    Faces inverse = inverse_diagonal(v_uv);
    out_u = u_weight * inverse.u * texture(u_rhs_u, v_uv);
    out_v = u_weight * inverse.v * texture(u_rhs_v, v_uv);
}
