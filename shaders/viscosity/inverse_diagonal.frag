// Inverse diagonal: 1 / diagonal of A on a coarse level, 0 for fixed faces; see operator.glsl and stress.frag.
// reads: 11
#include "viscosity/openness.glsl"
uniform sampler2D u_xx0;
uniform sampler2D u_yy0;
uniform sampler2D u_node0;
uniform sampler2D u_node1;
uniform sampler2D u_node2;
uniform vec2 u_shear;
layout(location = 0) out vec4 out_inverse_u;
layout(location = 1) out vec4 out_inverse_v;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), x = ivec2(1, 0), y = ivec2(0, 1);
    vec4 xx = texelFetch(u_xx0, at, 0), left = texelFetch(u_xx0, at - x, 0);
    vec4 yy = texelFetch(u_yy0, at, 0), above = texelFetch(u_yy0, at - y, 0);
    vec4 n = texelFetch(u_node0, at, 0), right = texelFetch(u_node0, at + x, 0), below = texelFetch(u_node0, at + y, 0);
    vec2 s = u_shear * u_shear;
    out_inverse_u = open_u(own_texel())
        / (1.0 + xx + vec4(left.y, xx.x, left.w, xx.z) + s.x * (n + vec4(n.zw, below.xy) - 2.0 * texelFetch(u_node2, at, 0)));
    out_inverse_v = open_v(own_texel())
        / (1.0 + yy + vec4(above.zw, yy.xy) + s.y * (n + vec4(n.y, right.x, n.w, right.z) - 2.0 * texelFetch(u_node1, at, 0)));
}
