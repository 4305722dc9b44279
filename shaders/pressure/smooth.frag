// Red-black Gauss-Seidel: the cells of one colour solved for, with their neighbours as they are.
//   p += (A p - r) / (sum of links)
// in:  u_pressure   p at blocks;  u_residual   r at blocks;  links of lib/block.glsl
// With RED: the cells x and w of a block, else y and z. With FROM_ZERO p is 0, and the red ones come first, then the black.
// out: p at blocks
// reads: 13
#include "lib/block.glsl"

uniform sampler2D u_pressure;
uniform sampler2D u_residual;

in vec2 v_uv;
out vec4 out_pressure;

vec4 from_zero(vec2 uv) { return -inverse_diagonal(uv) * texture(u_residual, uv); }

void main() {
    Links f = links_of(floor(gl_FragCoord.xy), v_uv);
    vec4 inverse = inverse_diagonal(v_uv), residual = texture(u_residual, v_uv);
#ifdef FROM_ZERO
    const vec4 red = vec4(1.0, 0.0, 0.0, 1.0);
    vec2 texel = 1.0 / vec2(textureSize(u_residual, 0)), across = vec2(texel.x, 0.0), down = vec2(0.0, texel.y);
    vec4 here = -red * inverse * residual;
    vec4 applied = laplacian(from_zero(v_uv - across), from_zero(v_uv + across), from_zero(v_uv - down),
                             from_zero(v_uv + down), here, f);
#else
    vec4 here = texture(u_pressure, v_uv), applied = laplacian(u_pressure, v_uv, here, f);
#endif
    vec4 solved = here + inverse * (applied - residual);
#ifdef RED
    out_pressure = vec4(solved.x, here.yz, solved.w);
#else
    out_pressure = vec4(here.x, solved.yz, here.w);
#endif
}
