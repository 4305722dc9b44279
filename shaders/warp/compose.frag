// Compose: D(x) = S(x) + A(x + S(x)), the displacement of the whole map: what was gathered since the last remap, then the
// accumulated map. x + S(x) is kept in the picture and x + D(x) within u_limits, which the texels of both are: between
// them a polynomial reaches beyond, and what is composed again and again would grow without end.
// u_submap (S), u_accumulated (A): displacements, longer sides, over the same domain, each of any number of texels;
// u_extent: width and height of the domain; u_limits: left, top, right, bottom, longer sides; x: see lib/place.glsl.
// Define CUBIC to look into A by the cubic, as whoever looks between the texels of the result will again.
// Define HELD if there are cells, of u_held 1, in which the map does not change: nothing is added to A there.
// reads: 48, and 24 with CUBIC
#include "lib/displacement.glsl"
#include "lib/place.glsl"
uniform sampler2D u_submap;
uniform sampler2D u_accumulated;
uniform vec2 u_extent;
uniform vec4 u_limits;
#ifdef HELD
uniform sampler2D u_held;
#endif
layout(location = 0) out vec2 out_displacement;

// Where nothing is beyond the limits, nothing is added, so that the identity stays one to the bit.
vec2 within_limits(vec2 place, vec2 moved) {
    vec2 there = place * u_extent + moved;
    return moved + (clamp(there, u_limits.xy, u_limits.zw) - there);
}

void main() {
    vec2 place = fragment_place();
#ifdef HELD
    if (texture(u_held, place).r > 0.5) {
        // To the bit: on a texel its very value, however its place was rounded, and between texels by the cubic both
        // ways, which from a cell whose neighbours are held too reaches none that moves.
        mat2 slope;
        vec2 p = place * vec2(textureSize(u_accumulated, 0)), texel = floor(p) + 0.5;
        p = mix(p, texel, lessThan(abs(p - texel), vec2(1.0 / 512.0)));
        out_displacement = within_limits(place, cubic_displacement(u_accumulated, p, slope));
        return;
    }
#endif
    vec2 moved = cubic_displacement(u_submap, place * vec2(textureSize(u_submap, 0)));
    vec2 there = place + moved / u_extent, kept = clamp(there, 0.0, 1.0);
    vec2 p = kept * vec2(textureSize(u_accumulated, 0));
    moved += (kept - there) * u_extent;
#ifdef CUBIC
    moved += cubic_displacement(u_accumulated, p);
#else
    moved += quintic_displacement(u_accumulated, p);
#endif
    out_displacement = within_limits(place, moved);
}
