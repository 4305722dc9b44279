// Compose: D(x), the displacement of the whole map: the submap S on its window of the picture, the identity outside it,
// then the accumulated map A, which covers the picture: D(x) = S(x) + A(x + S(x)). x + S(x) is kept in the picture and
// x + D(x) within u_limits, which the texels of both are: between them a polynomial reaches beyond, and what is composed
// again and again would grow without end.
// u_submap, u_accumulated: displacements, longer sides, each of any number of texels; u_window: left, top, width and
// height that the submap covers, u_picture: width and height of the picture, longer sides; u_limits: left, top, right,
// bottom, longer sides; x: see lib/place.glsl.
// Define REMAP if the fragments are the texels of A, which then are met to the bit where nothing has moved.
// Define CUBIC to look into A by the cubic: where it has four texels a cell, or whoever looks between the texels of the
// result will again.
// Define HELD if there are cells, of u_held 1, in which the map does not change: nothing is added to A there.
// reads: 48, and 24 with CUBIC
#include "lib/displacement.glsl"
#include "lib/place.glsl"
uniform sampler2D u_submap;
uniform sampler2D u_accumulated;
uniform vec4 u_window;
uniform vec2 u_picture;
uniform vec4 u_limits;
#ifdef HELD
uniform sampler2D u_held;
#endif
layout(location = 0) out vec2 out_displacement;

// Where nothing is beyond the limits, nothing is added, so that the identity stays one to the bit.
vec2 within(vec4 limits, vec2 x, vec2 moved) { return moved + (clamp(x + moved, limits.xy, limits.zw) - (x + moved)); }

void main() {
    vec2 size = vec2(textureSize(u_accumulated, 0)), texel = u_picture / size;
#ifdef REMAP
    vec2 place = gl_FragCoord.xy;
#else
    vec2 place = fragment_place() * size;
#endif
    vec2 x = place * texel, across = (x - u_window.xy) / u_window.zw;
    vec2 inside = step(abs(across - 0.5), vec2(0.5));
#ifdef HELD
    if (inside.x * inside.y * texture(u_held, across).r > 0.5) {
        // To the bit: on a texel its very value, however its place was rounded, and between texels by the cubic both
        // ways, which from a cell whose neighbours are held too reaches none that moves.
        mat2 slope;
        vec2 nearest = floor(place) + 0.5;
        place = mix(place, nearest, lessThan(abs(place - nearest), vec2(1.0 / 512.0)));
        out_displacement = within(u_limits, x, cubic_displacement(u_accumulated, place, slope));
        return;
    }
#endif
    vec2 moved = cubic_displacement(u_submap, across * vec2(textureSize(u_submap, 0))) * (inside.x * inside.y);
    moved = within(vec4(0.0, 0.0, u_picture), x, moved);
    place += moved / texel;
#ifdef CUBIC
    moved += cubic_displacement(u_accumulated, place);
#else
    moved += quintic_displacement(u_accumulated, place);
#endif
    out_displacement = within(u_limits, x, moved);
}
