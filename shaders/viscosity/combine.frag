// Combine: the solution from the ways of conjugate gradients, x = sum alpha_k p_k with p_k = z_k + beta_k p_(k-1), z_0
// being the mixture that least.frag found of f and d; and what it has made of f, which is the next step's d.
// u_factors: (alpha, beta) of the steps, a texel each, of the first the mixture in GA; u_first_u, u_first_v: f;
// u_change_u, u_change_v: d; u_z1_u, u_z1_v, ...: the ways z, WAYS of them.
// reads: 12
#ifndef WAYS
#define WAYS 0
#endif
uniform sampler2D u_factors;
uniform sampler2D u_first_u;
uniform sampler2D u_first_v;
uniform sampler2D u_change_u;
uniform sampler2D u_change_v;
#if WAYS > 0
uniform sampler2D u_z1_u;
uniform sampler2D u_z1_v;
#endif
#if WAYS > 1
uniform sampler2D u_z2_u;
uniform sampler2D u_z2_v;
#endif
#if WAYS > 2
uniform sampler2D u_z3_u;
uniform sampler2D u_z3_v;
#endif
#if WAYS > 3
uniform sampler2D u_z4_u;
uniform sampler2D u_z4_v;
#endif
#if WAYS > 4
uniform sampler2D u_z5_u;
uniform sampler2D u_z5_v;
#endif
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;
layout(location = 2) out vec4 out_change_u;
layout(location = 3) out vec4 out_change_v;

void add(sampler2D u, sampler2D v, float factor) {
    out_u += factor * texture(u, v_uv);
    out_v += factor * texture(v, v_uv);
}

void main() {
    // How much of each z there is in the end: that of its own p, and what later ones take over.
    float total[WAYS + 1], later = 0.0;
    for (int k = WAYS; k >= 0; --k) {
        vec2 factors = texelFetch(u_factors, ivec2(k, 0), 0).xy;
        total[k] = factors.x + later;
        later = factors.y * total[k];
    }
    vec4 first_u = texture(u_first_u, v_uv), first_v = texture(u_first_v, v_uv);
    vec2 mixture = total[0] * texelFetch(u_factors, ivec2(0), 0).yw;
    out_u = mixture.x * first_u;
    out_v = mixture.x * first_v;
    add(u_change_u, u_change_v, mixture.y);
#if WAYS > 0
    add(u_z1_u, u_z1_v, total[1]);
#endif
#if WAYS > 1
    add(u_z2_u, u_z2_v, total[2]);
#endif
#if WAYS > 2
    add(u_z3_u, u_z3_v, total[3]);
#endif
#if WAYS > 3
    add(u_z4_u, u_z4_v, total[4]);
#endif
#if WAYS > 4
    add(u_z5_u, u_z5_v, total[5]);
#endif
    out_change_u = out_u - first_u;
    out_change_v = out_v - first_v;
}
