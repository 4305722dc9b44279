// Distortion: how the map x + D(x) stretches and folds, by the chain rule: J is the product of the Jacobians of its parts
// (lib/warp.glsl), each by the derivatives of the cubic both ways, so that nothing depends on how far apart the places are.
// With HELD, where the map is held, by those of what is kept of it.
// x: see lib/place.glsl.
// largest: (-det J, det J, |D|), to be reduced to the largest of each;
// total: (1 where det J <= 0, |D|, |det J - 1|), to be reduced to their sums.
// reads: 32, and 16 more for each of LEVELS above 1, 4 for each of WEIGHED
#include "lib/warp.glsl"
#include "lib/place.glsl"
layout(location = 0) out vec4 out_largest;
layout(location = 1) out vec4 out_total;

// Determinant of 1 + grad (w S) of a submap at x + moved, w its weight; w S is added to `moved`.
float stretch_of(int level, sampler2D submap, vec4 window, vec2 x, inout vec2 moved) {
    vec2 place = x + moved, size = vec2(textureSize(submap, 0)), density = size / window.zw;
    vec3 at = in_window(window, place);
    mat2 slope;
    vec2 fading;
    float w = weight(level, submap, window, place, fading);
    fading *= vec2(textureSize(u_accumulated, 0)) / u_picture;
    vec2 more = cubic_displacement(submap, at.xy * size, slope);
    moved = within_picture(x, moved + w * more * at.z);
    return determinant(mat2(1.0) + at.z * (w * mat2(slope[0] * density.x, slope[1] * density.y) + outerProduct(more, fading)));
}

// Determinant of the whole map's Jacobian at x; D(x) goes to `moved`.
float determinant_at(vec2 x, out vec2 moved) {
    mat2 slope;
    vec2 size = vec2(textureSize(u_accumulated, 0)), density = size / u_picture;
    moved = vec2(0.0);
#ifdef HELD
    // Not on a texel that is held by itself: its slopes would be those to others, which are not kept.
    if (texture(u_held, x / u_picture).r > 0.9) {
        moved = cubic_displacement(u_kept, on_texel(x * density), slope);
        return determinant(mat2(1.0) + mat2(slope[0] * density.x, slope[1] * density.y));
    }
#endif
    float change = stretch_of(1, u_submap, u_window, x, moved);
#if LEVELS > 1
    change *= stretch_of(2, u_second, u_second_window, x, moved);
#endif
#if LEVELS > 2
    change *= stretch_of(4, u_third, u_third_window, x, moved);
#endif
    moved += cubic_displacement(u_accumulated, (x + moved) * density, slope);
    return change * determinant(mat2(1.0) + mat2(slope[0] * density.x, slope[1] * density.y));
}

void main() {
    vec2 moved;
    float change = determinant_at(fragment_place() * u_picture, moved), far = length(moved);
    out_largest = vec4(-change, change, far, 0.0);
    out_total = vec4(change <= 0.0 ? 1.0 : 0.0, far, abs(change - 1.0), 0.0);
}
