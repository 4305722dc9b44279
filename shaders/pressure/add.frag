// a + b.
// in:  u_a, u_b   at blocks
// reads: 2
uniform sampler2D u_a;
uniform sampler2D u_b;

in vec2 v_uv;
out vec4 out_sum;

void main() { out_sum = texture(u_a, v_uv) + texture(u_b, v_uv); }
