// Distortion: how the map x + D(x) stretches and folds, by the chain rule: J is the product of the Jacobians of its parts
// (lib/warp.glsl), each by the derivatives of the cubic both ways, so that nothing depends on how far apart the places are.
// x: see lib/place.glsl.
// largest: (-det J, det J, |D|), to be reduced to the largest of each;
// total: (1 where det J <= 0, |D|, |det J - 1|), to be reduced to their sums.
// reads: 32, and 16 more for each of LEVELS above 1
#include "lib/warp.glsl"
#include "lib/place.glsl"
layout(location = 0) out vec4 out_largest;
layout(location = 1) out vec4 out_total;

// Determinant of 1 + grad S of a submap at x + moved; S is added to `moved`.
float stretch_of(sampler2D submap, vec4 window, vec2 x, inout vec2 moved) {
    vec2 place = x + moved, size = vec2(textureSize(submap, 0)), density = size / window.zw;
    vec3 at = in_window(window, place);
    mat2 slope;
    vec2 more = cubic_displacement(submap, at.xy * size, slope);
    moved = within_picture(x, moved + more * at.z);
    return determinant(mat2(1.0) + at.z * mat2(slope[0] * density.x, slope[1] * density.y));
}

void main() {
    vec2 x = fragment_place() * u_picture, size = vec2(textureSize(u_accumulated, 0)), density = size / u_picture;
    vec2 moved = vec2(0.0);
    float change = stretch_of(u_submap, u_window, x, moved);
#if LEVELS > 1
    change *= stretch_of(u_second, u_second_window, x, moved);
#endif
#if LEVELS > 2
    change *= stretch_of(u_third, u_third_window, x, moved);
#endif
    mat2 slope;
    vec2 more = cubic_displacement(u_accumulated, (x + moved) * density, slope);
    change *= determinant(mat2(1.0) + mat2(slope[0] * density.x, slope[1] * density.y));
    float far = length(moved + more);
    out_largest = vec4(-change, change, far, 0.0);
    out_total = vec4(change <= 0.0 ? 1.0 : 0.0, far, abs(change - 1.0), 0.0);
}
