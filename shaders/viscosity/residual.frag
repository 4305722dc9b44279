// Residual: b - A f on open faces, zero on pinned ones.
// u_u, u_v: f; u_right_u, u_right_v: b.
// reads: 19
#include "viscosity/block.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_right_u;
uniform sampler2D u_right_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    Stiffness k = read_stiffness(v_uv);
    Faces f, af = apply_matrix(u_u, u_v, v_uv, k, f);
    out_u = k.open_u * (texture(u_right_u, v_uv) - af.u);
    out_v = k.open_v * (texture(u_right_v, v_uv) - af.v);
}
