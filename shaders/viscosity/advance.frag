// Advance: the residual after a step of conjugate gradients, and on it the first damped Jacobi sweep of the next cycle.
// s = A z + beta s_before (which is A p), r -= alpha s, f = weight D^-1 r.
// u_factors: (alpha, beta) of the steps, a texel each; u_right_u, u_right_v: r; u_u, u_v: A z; u_stress_u, u_stress_v: s of
// the step before (FIRST: there is none, and s is A z).
// reads: 9
#include "viscosity/block.glsl"
uniform sampler2D u_factors;
uniform int u_step;
uniform float u_weight;
uniform sampler2D u_right_u;
uniform sampler2D u_right_v;
uniform sampler2D u_u;
uniform sampler2D u_v;
#ifndef FIRST
uniform sampler2D u_stress_u;
uniform sampler2D u_stress_v;
#endif
in vec2 v_uv;
layout(location = 0) out vec4 out_r_u;
layout(location = 1) out vec4 out_r_v;
layout(location = 2) out vec4 out_u;
layout(location = 3) out vec4 out_v;
#ifndef FIRST
layout(location = 4) out vec4 out_s_u;
layout(location = 5) out vec4 out_s_v;
#endif

void main() {
    vec2 factors = texelFetch(u_factors, ivec2(u_step, 0), 0).xy;
    vec4 s_u = texture(u_u, v_uv), s_v = texture(u_v, v_uv);
#ifndef FIRST
    s_u += factors.y * texture(u_stress_u, v_uv);
    s_v += factors.y * texture(u_stress_v, v_uv);
    out_s_u = s_u;
    out_s_v = s_v;
#endif
    Faces inverse = inverse_diagonal(v_uv);
    out_r_u = texture(u_right_u, v_uv) - factors.x * s_u;
    out_r_v = texture(u_right_v, v_uv) - factors.x * s_v;
    out_u = u_weight * inverse.u * out_r_u;
    out_v = u_weight * inverse.v * out_r_v;
}
