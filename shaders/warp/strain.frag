// Strain: what the map does to what lies close to x, so that it may be told whether it bears to be bent further: D(x) (longer
// sides); det J; and the same with what becomes of the area between the next texels of what a remap draws anew, which keeps
// what is at its texels only: see Bend.
// x: see lib/place.glsl.
// reads: 28, and 8 more for each of LEVELS above 1, 16 of CLOSED, 4 for each of WEIGHED
#include "lib/place.glsl"
#include "lib/jacobian.glsl"
layout(location = 0) out vec4 out_strain;

void main() {
    vec2 x = fragment_place() * u_picture;
    Bend bend = bend_at(x);
    out_strain = vec4(within(u_limits, x, bend.moved), bend.determinant, bend.between);
}
