// Damp: the residual of a part of v*, from the residual r of v* itself and the right-hand side b.
// u_part: that part, at most one; u_r_u, u_r_v: r; u_u, u_v: b.
// reads: 5
uniform sampler2D u_part;
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_r_u;
uniform sampler2D u_r_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    float part = texelFetch(u_part, ivec2(0), 0).x;
    out_u = mix(texture(u_u, v_uv), texture(u_r_u, v_uv), part);
    out_v = mix(texture(u_v, v_uv), texture(u_r_v, v_uv), part);
}
