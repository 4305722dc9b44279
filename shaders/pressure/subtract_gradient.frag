// The velocity made free of divergence, still in blocks:  u - (p - p_left),  v - (p - p_up),  and 0 on closed faces.
// The pressure comes as a sum that is taken only after the differences, which keeps the digits of the smaller part.
// in:  u_velocity         MAC velocity, lengths / s
//      u_base, u_change   the two parts of pressure / h at blocks, lengths / s
//      u_left, u_up, u_far, u_span   faces
// out: u and v of the blocks' four cells, lengths / s
// reads: 13
#include "lib/block_faces.glsl"

uniform sampler2D u_velocity;
uniform sampler2D u_base;
uniform sampler2D u_change;

layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void differences(sampler2D p, out vec4 dx, out vec4 dy) {
    vec4 here = texture(p, v_uv);
    dx = here - vec4(textureOffset(p, v_uv, ivec2(-1, 0)).yw, here.xz).xzyw;
    dy = here - vec4(textureOffset(p, v_uv, ivec2(0, -1)).zw, here.xy);
}

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_velocity, 0)), a = (2.0 * floor(gl_FragCoord.xy) + 0.5) * texel, b = a + texel;
    vec2 v00 = texture(u_velocity, a).rg, v10 = texture(u_velocity, vec2(b.x, a.y)).rg;
    vec2 v01 = texture(u_velocity, vec2(a.x, b.y)).rg, v11 = texture(u_velocity, b).rg;
    vec4 base_x, base_y, change_x, change_y;
    differences(u_base, base_x, base_y);
    differences(u_change, change_x, change_y);
    Faces f = faces();
    out_u = f.left * (vec4(v00.x, v10.x, v01.x, v11.x) - base_x - change_x);
    out_v = f.up * (vec4(v00.y, v10.y, v01.y, v11.y) - base_y - change_y);
}
