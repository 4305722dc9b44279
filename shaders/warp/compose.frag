// Compose: C(x) = D(x) + B(x + D(x)), the displacement of the whole map: what was gathered since the last fold, then the
// base.
// u_near (D), u_base (B): displacements, longer sides, over the same domain, each of any number of texels;
// u_extent: width and height of the domain, longer sides; x: see lib/place.glsl.
// reads: 48
#include "lib/displacement.glsl"
#include "lib/place.glsl"
uniform sampler2D u_near;
uniform sampler2D u_base;
uniform vec2 u_extent;
layout(location = 0) out vec2 out_displacement;

void main() {
    vec2 place = fragment_place();
    vec2 near = cubic_displacement(u_near, place * vec2(textureSize(u_near, 0)));
    place = clamp(place + near / u_extent, 0.0, 1.0);
    out_displacement = near + quintic_displacement(u_base, place * vec2(textureSize(u_base, 0)));
}
