// Advance: the residual after a step of conjugate gradients, and on it the first damped Jacobi sweep of the next cycle.
// s = A z + beta s_before (which is A p), r_next = r - alpha s, f = weight D^-1 r_next; s_before from the residuals either
// side of its step.
// u_factors: (alpha, beta) of the steps, a texel each; u_right_u, u_right_v: r; u_u, u_v: A z; u_before_u, u_before_v: r
// before the last step. FIRST: there is none, and s is the mixture that least.frag found of A f and of A d, which is in
// u_change_u, u_change_v.
// reads: 10
#include "viscosity/block.glsl"
uniform sampler2D u_factors;
uniform int u_step;
uniform float u_weight;
uniform sampler2D u_right_u;
uniform sampler2D u_right_v;
uniform sampler2D u_u;
uniform sampler2D u_v;
#ifdef FIRST
uniform sampler2D u_change_u;
uniform sampler2D u_change_v;
#else
uniform sampler2D u_before_u;
uniform sampler2D u_before_v;
#endif
in vec2 v_uv;
layout(location = 0) out vec4 out_r_u;
layout(location = 1) out vec4 out_r_v;
layout(location = 2) out vec4 out_u;
layout(location = 3) out vec4 out_v;

void main() {
    vec4 factors = texelFetch(u_factors, ivec2(u_step, 0), 0);
    vec4 s_u = texture(u_u, v_uv), s_v = texture(u_v, v_uv), r_u = texture(u_right_u, v_uv), r_v = texture(u_right_v, v_uv);
#ifdef FIRST
    s_u = factors.y * s_u + factors.w * texture(u_change_u, v_uv);
    s_v = factors.y * s_v + factors.w * texture(u_change_v, v_uv);
#else
    float alpha = texelFetch(u_factors, ivec2(u_step - 1, 0), 0).x, beta = alpha == 0.0 ? 0.0 : factors.y / alpha;
    s_u += beta * (texture(u_before_u, v_uv) - r_u);
    s_v += beta * (texture(u_before_v, v_uv) - r_v);
#endif
    Faces inverse = inverse_diagonal(v_uv);
    out_r_u = r_u - factors.x * s_u;
    out_r_v = r_v - factors.x * s_v;
    out_u = u_weight * inverse.u * out_r_u;
    out_v = u_weight * inverse.v * out_r_v;
}
