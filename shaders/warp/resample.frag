// Resample: a displacement at other places, six-point Lagrange.
// u_displacement: longer sides, over the whole domain; x: see lib/place.glsl.
// reads: 36
#include "lib/displacement.glsl"
#include "lib/place.glsl"
uniform sampler2D u_displacement;
layout(location = 0) out vec2 out_displacement;

void main() {
    out_displacement = quintic_displacement(u_displacement, fragment_place() * vec2(textureSize(u_displacement, 0)), 0.0);
}
