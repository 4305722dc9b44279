// Half a sweep of red-black Gauss-Seidel: the cells of one colour solved for, with their neighbours as they are.
//   p += (A p - r) / (sum of links)
// in:  u_pressure   p at blocks, none with FROM_ZERO (p = 0);  u_residual   r at blocks;  links of lib/block.glsl
// With RED: the cells x and w of a block, else y and z.
// out: p at blocks
// reads: 9
#include "lib/block.glsl"

uniform sampler2D u_pressure;
uniform sampler2D u_residual;

in vec2 v_uv;
out vec4 out_pressure;

void main() {
    Links f = links_of(floor(gl_FragCoord.xy), v_uv);
    vec4 sum = diagonal(f), here = vec4(0.0), change = -texture(u_residual, v_uv);
#ifndef FROM_ZERO
    here = texture(u_pressure, v_uv);
    change += laplacian(u_pressure, v_uv, here, f);
#endif
    vec4 solved = here + change * vec4(greaterThan(sum, vec4(0.0))) / max(sum, 1e-6);
#ifdef RED
    out_pressure = vec4(solved.x, here.yz, solved.w);
#else
    out_pressure = vec4(here.x, solved.yz, here.w);
#endif
}
