// Load: the right-hand side of the viscous step from the velocity on the MAC grid, packed as in block.glsl.
// u_velocity: lengths / s. With NO_SLIP walls that move along themselves at u_wall_speed (left, right, top, bottom) drag
// the faces next to them: K_node times their speed.
// reads: 8
#include "viscosity/block.glsl"
uniform sampler2D u_velocity;
#ifdef NO_SLIP
uniform vec4 u_wall_speed;
#endif
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    ivec2 size = textureSize(u_velocity, 0), corner = 2 * (ivec2(gl_FragCoord.xy) - 1), last = size - 1;
    vec2 a = texelFetch(u_velocity, corner, 0).rg, b = texelFetch(u_velocity, min(corner + ivec2(1, 0), last), 0).rg;
    vec2 c = texelFetch(u_velocity, min(corner + ivec2(0, 1), last), 0).rg;
    vec2 d = texelFetch(u_velocity, min(corner + 1, last), 0).rg;
    out_u = vec4(a.r, b.r, c.r, d.r);
    out_v = vec4(a.g, b.g, c.g, d.g);
#ifdef NO_SLIP
    Stiffness k = read_stiffness(v_uv);
    ivec4 i = corner.x + ivec4(0, 1, 0, 1), j = corner.y + ivec4(0, 0, 1, 1);
    out_u += u_wall_speed.z * k.node * vec4(equal(j, ivec4(0))) + u_wall_speed.w * k.node_below * vec4(equal(j, ivec4(last.y)));
    out_v += u_wall_speed.x * k.node * vec4(equal(i, ivec4(0))) + u_wall_speed.y * k.node_right * vec4(equal(i, ivec4(last.x)));
#endif
    out_u *= open_u(own_texel());
    out_v *= open_v(own_texel());
}
