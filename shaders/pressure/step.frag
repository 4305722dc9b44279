// A step along z, less u_beta times the way before, q, so far that the residual r is least.
// in:  u_alpha   how far;  u_beta;  u_z, u_applied   z and A z at blocks;  u_residual   r
//      u_way, u_before   q and A q (none with FIRST)
// out: the correction, pressure / h;  what it leaves of r, lengths / s;  the way of this step and A times it
// reads: 5
uniform float u_alpha;
uniform float u_beta;
uniform sampler2D u_z;
uniform sampler2D u_applied;
uniform sampler2D u_residual;
uniform sampler2D u_way;
uniform sampler2D u_before;

in vec2 v_uv;
layout(location = 0) out vec4 out_correction;
layout(location = 1) out vec4 out_residual;
layout(location = 2) out vec4 out_way;
layout(location = 3) out vec4 out_applied;

void main() {
    out_way = texture(u_z, v_uv);
    out_applied = texture(u_applied, v_uv);
#ifndef FIRST
    out_way -= u_beta * texture(u_way, v_uv);
    out_applied -= u_beta * texture(u_before, v_uv);
#endif
    out_correction = u_alpha * out_way;
    out_residual = texture(u_residual, v_uv) - u_alpha * out_applied;
}
