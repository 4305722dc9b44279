// Density carried by the fluid: phi(x) = phi(x - dt v(x)), second-order backtrace, bilinear, as the paper has it
// (section 3.2, equation (5), first term).
// u_density: up to four densities, on a grid of its own; u_velocity: MAC faces, lengths / s; u_cells_a_speed:
// dt / spacing of the fluid's grid.
// reads: 20
#include "lib/mac.glsl"
uniform sampler2D u_density;
uniform sampler2D u_velocity;
uniform vec2 u_cells_a_speed;
in vec2 v_uv;
layout(location = 0) out vec4 out_density;

void main() {
    vec2 cells = vec2(textureSize(u_velocity, 0)), size = vec2(textureSize(u_density, 0)), texel = 1.0 / size;
    vec2 p = v_uv * cells;
    vec2 back = mac_backtrace(u_velocity, p, mac_velocity(u_velocity, p), u_cells_a_speed);
    vec2 from = (p + back) / cells * size - 0.5;
    vec2 corner = floor(from), f = from - corner;
    vec4 at = vec4(corner + 0.5, corner + 1.5) * texel.xyxy;
    out_density = mix(mix(texture(u_density, at.xy), texture(u_density, at.zy), f.x),
                      mix(texture(u_density, at.xw), texture(u_density, at.zw), f.x), f.y);
}
