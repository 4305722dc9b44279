// Guess residual: what the first guess a f + c d of galerkin_guess.frag leaves, b - A (a f + c d).
// u_u, u_v: f; u_change_u, u_change_v: d; u_rhs_u, u_rhs_v: b; u_parts: (a, c).
// reads: 34
#include "viscosity/operator.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_change_u;
uniform sampler2D u_change_v;
uniform sampler2D u_rhs_u;
uniform sampler2D u_rhs_v;
uniform vec2 u_parts;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    Stiffness k = read_stiffness(v_uv);
    Faces f, d, af = apply_operator(u_u, u_v, v_uv, k, f), ad = apply_operator(u_change_u, u_change_v, v_uv, k, d);
    out_u = k.open_u * (texture(u_rhs_u, v_uv) - u_parts.x * af.u - u_parts.y * ad.u);
    out_v = k.open_v * (texture(u_rhs_v, v_uv) - u_parts.x * af.v - u_parts.y * ad.v);
}
