// Strain: what the map does to what lies close to x, so that it may be told whether it bears to be bent further: D(x) (longer
// sides); det J; and how many times larger in the original the area between x and the next texels of the accumulated map to
// the right and below is (half the product of its diagonals), negative where it is folded: as exact as a middle difference. A
// triangle of three of them, one-sided, tells of folds that are not there as soon as the map is bent within ten texels.
// x: see lib/place.glsl; or as near to it as none of them leaves the picture.
// reads: 104, and 52 more for each of LEVELS above 1, 16 for each of WEIGHED
#include "lib/warp.glsl"
#include "lib/place.glsl"
#include "lib/jacobian.glsl"
layout(location = 0) out vec4 out_strain;

vec2 displacement(vec2 x, vec2 density) {
#ifdef HELD
    if (is_held(x * density)) return within(u_limits, x, held_displacement(x * density));
#endif
    vec2 moved = displacement_of_submaps(x);
    return within(u_limits, x, moved + cubic_displacement(u_accumulated, (x + moved) * density, u_walled));
}

void main() {
    vec2 density = vec2(textureSize(u_accumulated, 0)) / u_picture, texel = 1.0 / density;
    vec2 x = min(fragment_place() * u_picture, u_picture - texel), moved;
    float determinant = determinant_at(x, moved);
    moved = within(u_limits, x, moved);
    vec2 right = displacement(x + vec2(texel.x, 0.0), density), below = displacement(x + vec2(0.0, texel.y), density);
    vec2 down = 1.0 + (displacement(x + texel, density) - moved) / texel, up = vec2(1.0, -1.0) + (right - below) / texel;
    out_strain = vec4(moved, determinant, 0.5 * (down.y * up.x - down.x * up.y));
}
