// Start: the first damped Jacobi sweep, from rest: f = weight D^-1 b.
// u_right_u, u_right_v: the right-hand side b; u_weight: of the sweep.
// reads: 4
#include "viscosity/block.glsl"
uniform sampler2D u_right_u;
uniform sampler2D u_right_v;
uniform float u_weight;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    Faces inverse = inverse_diagonal(v_uv);
    out_u = u_weight * inverse.u * texture(u_right_u, v_uv);
    out_v = u_weight * inverse.v * texture(u_right_v, v_uv);
}
