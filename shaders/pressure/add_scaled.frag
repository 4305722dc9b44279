// a + sign q b, with q the quotient of the sums in u_sums: the step along b that leaves least of a, or of its equation.
// in:  u_a, u_b   at blocks;  u_sign;  u_sums   see lib/quotient.glsl
// out: at blocks, the unit of a
// reads: 3
#include "lib/quotient.glsl"

uniform sampler2D u_a;
uniform sampler2D u_b;
uniform sampler2D u_sums;
uniform float u_sign;

in vec2 v_uv;
out vec4 out_sum;

void main() { out_sum = texture(u_a, v_uv) + u_sign * quotient(u_sums) * texture(u_b, v_uv); }
