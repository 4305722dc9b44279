// Residual: b - A f on open faces, zero on fixed ones.
// u_u, u_v: f; u_rhs_u, u_rhs_v: b.
// reads: 19
#include "viscosity/operator.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_rhs_u;
uniform sampler2D u_rhs_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    Faces f, is_open, af = apply_operator(u_u, u_v, v_uv, f, is_open);
    out_u = is_open.u * (texture(u_rhs_u, v_uv) - af.u);
    out_v = is_open.v * (texture(u_rhs_v, v_uv) - af.v);
}
