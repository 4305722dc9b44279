// A times the next search direction, and the dot products that tell how far to go along it.
//   d = z + beta d_before,  q = A d
// in:  u_z, u_before   z and d_before at blocks, the latter not with FIRST, where d = z;  u_residual   r;  u_beta
//      links of lib/block.glsl
// out: products r . z, d . q, r . q and q . q, summed over the block;  q at blocks;  d, not with FIRST
// reads: 14
#include "lib/block.glsl"

uniform sampler2D u_z;
uniform sampler2D u_before;
uniform sampler2D u_residual;
uniform float u_beta;

in vec2 v_uv;
layout(location = 0) out vec4 out_products;
layout(location = 1) out vec4 out_applied;
#ifndef FIRST
layout(location = 2) out vec4 out_direction;
#endif

void main() {
    Links f = links_of(floor(gl_FragCoord.xy), v_uv);
    vec4 z = texture(u_z, v_uv), r = texture(u_residual, v_uv);
    vec4 direction = z;
    out_applied = laplacian(u_z, v_uv, z, f);
#ifndef FIRST
    vec4 before = texture(u_before, v_uv);
    out_direction = direction = z + u_beta * before;
    out_applied += u_beta * laplacian(u_before, v_uv, before, f);
#endif
    out_products = vec4(dot(r, z), dot(direction, out_applied), dot(r, out_applied), dot(out_applied, out_applied));
}
