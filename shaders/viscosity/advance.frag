// Advance: one step of conjugate gradients, all its vectors at once.
// p = z + beta p, s = A z + beta s (which is A p), f += alpha p, r -= alpha s.
// u_factors: (alpha, beta); the others: the vectors, packed faces. FIRST: f, p and s begin here. LAST: only f is wanted.
// reads: 13
uniform sampler2D u_factors;
uniform sampler2D u_z_u;
uniform sampler2D u_z_v;
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_p_u;
uniform sampler2D u_p_v;
#ifndef LAST
uniform sampler2D u_az_u;
uniform sampler2D u_az_v;
uniform sampler2D u_s_u;
uniform sampler2D u_s_v;
uniform sampler2D u_r_u;
uniform sampler2D u_r_v;
#endif
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;
#ifndef LAST
layout(location = 2) out vec4 out_r_u;
layout(location = 3) out vec4 out_r_v;
layout(location = 4) out vec4 out_p_u;
layout(location = 5) out vec4 out_p_v;
layout(location = 6) out vec4 out_s_u;
layout(location = 7) out vec4 out_s_v;
#endif

#ifdef FIRST
vec4 onward(sampler2D latest, sampler2D before, float beta) { return texture(latest, v_uv); }
#else
vec4 onward(sampler2D latest, sampler2D before, float beta) { return texture(latest, v_uv) + beta * texture(before, v_uv); }
#endif

void main() {
    vec2 factors = texelFetch(u_factors, ivec2(0), 0).xy;
    vec4 p_u = onward(u_z_u, u_p_u, factors.y), p_v = onward(u_z_v, u_p_v, factors.y);
    out_u = factors.x * p_u;
    out_v = factors.x * p_v;
#ifndef FIRST
    out_u += texture(u_u, v_uv);
    out_v += texture(u_v, v_uv);
#endif
#ifndef LAST
    vec4 s_u = onward(u_az_u, u_s_u, factors.y), s_v = onward(u_az_v, u_s_v, factors.y);
    out_p_u = p_u;
    out_p_v = p_v;
    out_s_u = s_u;
    out_s_v = s_v;
    out_r_u = texture(u_r_u, v_uv) - factors.x * s_u;
    out_r_v = texture(u_r_v, v_uv) - factors.x * s_v;
#endif
}
