// Resample: a displacement at other places, six-point Lagrange.
// u_displacement: longer sides, over the whole domain; u_images: see lib/displacement.glsl; x: see lib/place.glsl.
// Define CUBIC for the cubic, of all components.
// reads: 36, or 12 with CUBIC
#include "lib/displacement.glsl"
#include "lib/place.glsl"
uniform sampler2D u_displacement;
uniform vec4 u_images;
layout(location = 0) out vec4 out_displacement;

void main() {
    vec2 place = fragment_place() * vec2(textureSize(u_displacement, 0));
#ifdef CUBIC
    out_displacement = cubic_texels(u_displacement, place, u_images);
#else
    out_displacement = vec4(quintic_displacement(u_displacement, place, u_images), 0.0, 0.0);
#endif
}
