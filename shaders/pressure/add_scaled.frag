// f a + g q b, with q the quotient of the sums in u_sums.
// in:  u_a, u_b   at blocks;  u_factors   (f, g);  u_sums   see lib/quotient.glsl
// out: at blocks, the unit of a
// reads: 3
#include "lib/quotient.glsl"

uniform sampler2D u_a;
uniform sampler2D u_b;
uniform sampler2D u_sums;
uniform vec2 u_factors;

in vec2 v_uv;
out vec4 out_sum;

void main() { out_sum = u_factors.x * texture(u_a, v_uv) + u_factors.y * quotient(u_sums) * texture(u_b, v_uv); }
