// Combine: the solution from the ways of conjugate gradients, x = sum alpha_k p_k with p_k = z_k + beta_k p_(k-1).
// u_factors: (alpha, beta) of the steps, a texel each; u_z0_u, u_z0_v, ...: the ways z, WAYS of them.
// reads: 14
#ifndef WAYS
#define WAYS 1
#endif
uniform sampler2D u_factors;
uniform sampler2D u_z0_u;
uniform sampler2D u_z0_v;
#if WAYS > 1
uniform sampler2D u_z1_u;
uniform sampler2D u_z1_v;
#endif
#if WAYS > 2
uniform sampler2D u_z2_u;
uniform sampler2D u_z2_v;
#endif
#if WAYS > 3
uniform sampler2D u_z3_u;
uniform sampler2D u_z3_v;
#endif
#if WAYS > 4
uniform sampler2D u_z4_u;
uniform sampler2D u_z4_v;
#endif
#if WAYS > 5
uniform sampler2D u_z5_u;
uniform sampler2D u_z5_v;
#endif
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void add(sampler2D u, sampler2D v, float factor) {
    out_u += factor * texture(u, v_uv);
    out_v += factor * texture(v, v_uv);
}

void main() {
    // How much of each z there is in the end: that of its own p, and what later ones take over.
    float total[WAYS], later = 0.0;
    for (int k = WAYS - 1; k >= 0; --k) {
        vec2 factors = texelFetch(u_factors, ivec2(k, 0), 0).xy;
        total[k] = factors.x + later;
        later = factors.y * total[k];
    }
    out_u = total[0] * texture(u_z0_u, v_uv);
    out_v = total[0] * texture(u_z0_v, v_uv);
#if WAYS > 1
    add(u_z1_u, u_z1_v, total[1]);
#endif
#if WAYS > 2
    add(u_z2_u, u_z2_v, total[2]);
#endif
#if WAYS > 3
    add(u_z3_u, u_z3_v, total[3]);
#endif
#if WAYS > 4
    add(u_z4_u, u_z4_v, total[4]);
#endif
#if WAYS > 5
    add(u_z5_u, u_z5_v, total[5]);
#endif
}
