// The paper's warp map: the coordinates q are advected like any density, first-order backtrace and bilinear
// (section 4.1, equation (5) with kappa = S = 0). Stored as the displacement q - x, in lengths.
// u_displacement: lengths; u_velocity: cell centres, lengths / s.
// reads: 9
#include "paper/collocated.glsl"
uniform sampler2D u_displacement;
uniform sampler2D u_velocity;
uniform float u_dt_over_h;
uniform float u_h;
layout(location = 0) out vec2 out_displacement;

vec2 coordinates(ivec2 c, ivec2 size) {
    ivec2 inside = clamp(c, ivec2(0), size - 1);
    return (vec2(inside) + 0.5) * u_h + texelFetch(u_displacement, inside, 0).rg;
}

void main() {
    ivec2 size = textureSize(u_displacement, 0);
    vec2 p = gl_FragCoord.xy;
    vec2 q = p - u_dt_over_h * texelFetch(u_velocity, ivec2(p), 0).rg - 0.5, f = fract(q);
    ivec2 c = ivec2(floor(q));
    vec2 carried = mix(mix(coordinates(c, size), coordinates(c + ivec2(1, 0), size), f.x),
                       mix(coordinates(c + ivec2(0, 1), size), coordinates(c + ivec2(1, 1), size), f.x), f.y);
    out_displacement = carried - p * u_h;
}
