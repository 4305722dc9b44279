// Strain: what the map does to what lies close to x, so that it may be told whether it bears to be bent further: D(x) (longer
// sides); det J; and how many times larger in the original the triangle of x with the next texels of the accumulated map to
// the right and below is, negative where it is folded.
// x: see lib/place.glsl; or as near to it as no triangle leaves the picture.
// reads: 80, and 40 more for each of LEVELS above 1, 12 for each of WEIGHED
#define CUBIC
#include "lib/warp.glsl"
#include "lib/place.glsl"
#include "lib/jacobian.glsl"
layout(location = 0) out vec4 out_strain;

void main() {
    vec2 texel = u_picture / vec2(textureSize(u_accumulated, 0)), x = min(fragment_place() * u_picture, u_picture - texel);
    Bend bend = bend_at(x);
    vec2 moved = within(u_limits, x, bend.moved);
    vec2 right = vec2(1.0, 0.0) + (displacement_at(x + vec2(texel.x, 0.0)) - moved) / texel.x;
    vec2 below = vec2(0.0, 1.0) + (displacement_at(x + vec2(0.0, texel.y)) - moved) / texel.y;
    out_strain = vec4(moved, bend.determinant, right.x * below.y - right.y * below.x);
}
