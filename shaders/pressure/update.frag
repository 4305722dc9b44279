// A step of conjugate gradients along d:  p += alpha d,  r -= alpha q.
// in:  u_pressure (none with FIRST: p = 0), u_direction   p and d at blocks;  u_alpha
//      u_residual, u_applied   r and q at blocks, none with LAST
// out: p and, not with LAST, r at blocks
// reads: 4
uniform sampler2D u_pressure;
uniform sampler2D u_residual;
uniform sampler2D u_direction;
uniform sampler2D u_applied;
uniform float u_alpha;

in vec2 v_uv;
layout(location = 0) out vec4 out_pressure;
#ifndef LAST
layout(location = 1) out vec4 out_residual;
#endif

void main() {
    out_pressure = u_alpha * texture(u_direction, v_uv);
#ifndef FIRST
    out_pressure += texture(u_pressure, v_uv);
#endif
#ifndef LAST
    out_residual = texture(u_residual, v_uv) - u_alpha * texture(u_applied, v_uv);
#endif
}
