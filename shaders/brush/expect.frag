// Expect: what det J would be if the map lost nothing, as a logarithm: E'(x) = E(x_d) - dt div V halfway. The fluid keeps
// areas, but for sources and what is local. Outside its window nothing changes. E stays within what det J can be in 32 bits:
// what a source has fed for minutes would be divided by zero.
// u_expected (E): over the whole picture; u_velocity (V): what carries the picture, MAC faces, lengths / s; u_cells_a_speed:
// dt / spacing; u_corner, u_scale: where the window begins in texels of E, and cells for each of them.
// reads: 79
#include "lib/mac.glsl"
#include "lib/displacement.glsl"
uniform sampler2D u_expected;
uniform sampler2D u_velocity;
uniform vec2 u_cells_a_speed;
uniform vec2 u_corner;
uniform vec2 u_scale;
layout(location = 0) out float out_expected;

const float MOST = 87.0; // the logarithm of the largest number of 32 bits, and less of the least

void main() {
    vec2 place = gl_FragCoord.xy, p = (place - u_corner) * u_scale, edge = vec2(textureSize(u_velocity, 0)), back = vec2(0.0);
    float grown = 0.0;
    if (all(greaterThan(p, vec2(0.0))) && all(lessThan(p, edge))) {
        back = mac_backtrace(u_velocity, p, mac_velocity(u_velocity, p), u_cells_a_speed);
        vec2 halfway = clamp(p + 0.5 * back, vec2(0.5), edge - 0.5), across = vec2(0.5, 0.0), down = vec2(0.0, 0.5);
        grown = u_cells_a_speed.x * (mac_velocity(u_velocity, halfway + across).x - mac_velocity(u_velocity, halfway - across).x)
              + u_cells_a_speed.y * (mac_velocity(u_velocity, halfway + down).y - mac_velocity(u_velocity, halfway - down).y);
    }
    out_expected = clamp(cubic_texels(u_expected, place + back / u_scale, vec4(0.0)).r - grown, -MOST, MOST);
}
