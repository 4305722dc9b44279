// Compose: C(x) = D(x) + B(x + D(x)), the displacement of the whole map: what was gathered since the last fold, then the
// base.
// u_near (D), u_base (B): displacements, longer sides, over the same domain, each of any number of texels;
// u_extent: width and height of the domain, longer sides; x: see lib/place.glsl.
// Define CUBIC to look into the base by the cubic, as whoever looks between the texels of the result will again.
// Define HELD if there are cells, of u_held 1, in which the map does not change: nothing is added to the base there.
// reads: 48, and 24 with CUBIC
#include "lib/displacement.glsl"
#include "lib/place.glsl"
uniform sampler2D u_near;
uniform sampler2D u_base;
uniform vec2 u_extent;
#ifdef HELD
uniform sampler2D u_held;
#endif
layout(location = 0) out vec2 out_displacement;

void main() {
    vec2 place = fragment_place();
#ifdef HELD
    if (texture(u_held, place).r > 0.5) {
        // To the bit: on a texel its very value, however its place was rounded, and between texels by the cubic both
        // ways, which from a cell whose neighbours are held too reaches none that moves.
        mat2 slope;
        vec2 p = place * vec2(textureSize(u_base, 0)), texel = floor(p) + 0.5;
        p = mix(p, texel, lessThan(abs(p - texel), vec2(1.0 / 512.0)));
        out_displacement = cubic_displacement(u_base, p, slope);
        return;
    }
#endif
    vec2 near = cubic_displacement(u_near, place * vec2(textureSize(u_near, 0)));
    place = clamp(place + near / u_extent, 0.0, 1.0);
    vec2 p = place * vec2(textureSize(u_base, 0));
#ifdef CUBIC
    out_displacement = near + cubic_displacement(u_base, p);
#else
    out_displacement = near + quintic_displacement(u_base, p);
#endif
}
