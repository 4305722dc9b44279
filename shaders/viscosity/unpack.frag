// Unpack: the velocity on the MAC grid from faces packed as in operator.glsl.
// u_u, u_v: packed faces, lengths / s.
// reads: 2
uniform sampler2D u_u;
uniform sampler2D u_v;
layout(location = 0) out vec2 out_velocity;

void main() {
    ivec2 c = ivec2(gl_FragCoord.xy), texel = (c >> 1) + 1;
    int q = (c.x & 1) + 2 * (c.y & 1);
    out_velocity = vec2(texelFetch(u_u, texel, 0)[q], texelFetch(u_v, texel, 0)[q]);
}
