// The next search direction and A times it, with the dot products that tell how far to go.
//   d = z + beta d_before,  q = A d
// in:  u_z, u_before   z and d_before at blocks, the latter not with FIRST;  u_residual   r;  u_beta
//      links of lib/block.glsl
// out: d and q at blocks;  r . z, d . q, r . q and q . q over the block
// reads: 14
#include "lib/block.glsl"

uniform sampler2D u_z;
uniform sampler2D u_before;
uniform sampler2D u_residual;
uniform float u_beta;

in vec2 v_uv;
layout(location = 0) out vec4 out_direction;
layout(location = 1) out vec4 out_applied;
layout(location = 2) out vec4 out_products;

void main() {
    Links f = links_of(floor(gl_FragCoord.xy), v_uv);
    vec4 z = texture(u_z, v_uv), r = texture(u_residual, v_uv);
    out_direction = z;
    out_applied = laplacian(u_z, v_uv, z, f);
#ifndef FIRST
    vec4 before = texture(u_before, v_uv);
    out_direction += u_beta * before;
    out_applied += u_beta * laplacian(u_before, v_uv, before, f);
#endif
    out_products = vec4(dot(r, z), dot(out_direction, out_applied), dot(r, out_applied), dot(out_applied, out_applied));
}
