// The Jacobian of the warp map by the chain rule: the product of those of its parts, each by the derivatives of the cubic
// both ways. 32 reads, and 16 more for each of LEVELS above 1, 4 for each of WEIGHED.
#include "lib/warp.glsl"

// Determinant of 1 + grad (w S) of a submap at x + moved, w its weight; w S is added to `moved`.
float stretch_of(int level, sampler2D submap, vec4 window, vec2 x, inout vec2 moved) {
    vec2 place = x + moved, size = vec2(textureSize(submap, 0)), density = size / window.zw;
    vec3 at = in_window(window, place);
    mat2 slope;
    vec2 fading;
    float w = weight(level, submap, window, place, fading);
    fading *= vec2(textureSize(u_accumulated, 0)) / u_picture;
    vec2 more = cubic_displacement(submap, at.xy * size, u_walled, slope);
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
        moved = cubic_displacement(u_kept, on_texel(x * density), 0.0, slope);
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
    moved += cubic_displacement(u_accumulated, (x + moved) * density, u_walled, slope);
    return change * determinant(mat2(1.0) + mat2(slope[0] * density.x, slope[1] * density.y));
}
