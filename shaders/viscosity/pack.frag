// Pack: a velocity on the MAC grid, 2 x 2 cells a texel as in operator.glsl, 0 on fixed faces.
// u_velocity: lengths / s.
// reads: 5
#ifdef UNIFORM
#include "viscosity/box.glsl"
#else
#include "viscosity/openness.glsl"
#endif
uniform sampler2D u_velocity;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    ivec2 corner = 2 * ivec2(own_texel()), last = textureSize(u_velocity, 0) - 1;
    vec2 a = texelFetch(u_velocity, corner, 0).rg, b = texelFetch(u_velocity, min(corner + ivec2(1, 0), last), 0).rg;
    vec2 c = texelFetch(u_velocity, min(corner + ivec2(0, 1), last), 0).rg;
    vec2 d = texelFetch(u_velocity, min(corner + 1, last), 0).rg;
    out_u = vec4(a.r, b.r, c.r, d.r) * open_u(own_texel());
    out_v = vec4(a.g, b.g, c.g, d.g) * open_v(own_texel());
}
