// Strain: what the map does to what lies close to x, so that it may be told whether it bears to be bent further: D(x) (longer
// sides); det J; and how many times larger in the original the area between x and the next texels of the accumulated map to
// the right and below is (half the product of its diagonals), negative where it is folded: as exact as a middle difference. A
// triangle of three of them, one-sided, tells of folds that are not there as soon as the map is bent within ten texels.
// x: see lib/place.glsl; or as near to it as none of them leaves the picture.
// reads: 104, and 52 more for each of LEVELS above 1 and of CLOSED, 16 for each of WEIGHED
#define CUBIC
#include "lib/warp.glsl"
#include "lib/place.glsl"
#include "lib/jacobian.glsl"
layout(location = 0) out vec4 out_strain;

void main() {
    vec2 texel = u_picture / vec2(textureSize(u_accumulated, 0)), x = min(fragment_place() * u_picture, u_picture - texel);
    Bend bend = bend_at(x);
    vec2 moved = within(u_limits, x, bend.moved);
    vec2 right = displacement_at(x + vec2(texel.x, 0.0)), below = displacement_at(x + vec2(0.0, texel.y));
    vec2 down = 1.0 + (displacement_at(x + texel) - moved) / texel, up = vec2(1.0, -1.0) + (right - below) / texel;
    out_strain = vec4(moved, bend.determinant, 0.5 * (down.y * up.x - down.x * up.y));
}
