// A step of conjugate gradients along d:  p += alpha d,  r -= alpha q.
// in:  u_pressure (none with FIRST: p = 0), u_residual, u_direction, u_applied   p, r, d and q at blocks;  u_alpha
// out: p and r at blocks
// reads: 4
uniform sampler2D u_pressure;
uniform sampler2D u_residual;
uniform sampler2D u_direction;
uniform sampler2D u_applied;
uniform float u_alpha;

in vec2 v_uv;
layout(location = 0) out vec4 out_pressure;
layout(location = 1) out vec4 out_residual;

void main() {
    out_pressure = u_alpha * texture(u_direction, v_uv);
#ifndef FIRST
    out_pressure += texture(u_pressure, v_uv);
#endif
    out_residual = texture(u_residual, v_uv) - u_alpha * texture(u_applied, v_uv);
}
