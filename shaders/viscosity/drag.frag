// Drag: the right-hand side between no-slip walls that move along themselves, v* and for the faces next to them K_node
// times the walls' speed, as in operator.glsl.
// u_u, u_v: v*; u_wall_speed: of the left, right, top and bottom wall, lengths / s; u_size: size of the grid.
// reads: 8
#include "viscosity/operator.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform vec4 u_wall_speed;
uniform vec2 u_size;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    Stiffness k = read_stiffness(v_uv);
    vec2 corner = 2.0 * own_texel(), last = u_size - 1.0;
    vec4 i = corner.x + vec4(0.0, 1.0, 0.0, 1.0), j = corner.y + vec4(0.0, 0.0, 1.0, 1.0);
    vec4 top = k.node * vec4(equal(j, vec4(0.0))), bottom = k.node_below * vec4(equal(j, vec4(last.y)));
    vec4 left = k.node * vec4(equal(i, vec4(0.0))), right = k.node_right * vec4(equal(i, vec4(last.x)));
    out_u = texture(u_u, v_uv) + u_shear.x * u_shear.x * k.open_u * (u_wall_speed.z * top + u_wall_speed.w * bottom);
    out_v = texture(u_v, v_uv) + u_shear.y * u_shear.y * k.open_v * (u_wall_speed.x * left + u_wall_speed.y * right);
}
