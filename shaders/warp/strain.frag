// Strain: what the map does to what lies close to x, so that it may be told whether it bears to be bent further: D(x) (longer
// sides); det J; and how many times larger in the original the triangle of x with the next texels of the accumulated map to
// the right and below is, negative where it is folded.
// x: see lib/place.glsl; or as near to it as no triangle leaves the picture.
// reads: 80, and 40 more for each of LEVELS above 1, 12 for each of WEIGHED
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
    vec2 across = displacement(x + texel, density);
    vec2 d1 = texel + across - moved, d2 = vec2(-texel.x, texel.y) + below - right;
    out_strain = vec4(moved, determinant, 0.5 * (d1.x * d2.y - d1.y * d2.x) / (texel.x * texel.y));
}
