// The Jacobian of the warp map by the chain rule: the product of those of its parts, each by the derivatives of the cubic
// both ways. 32 reads, and 16 more for each of LEVELS above 1 and of CLOSED, 4 for each of WEIGHED.
#include "lib/warp.glsl"

// What the map does at x.
struct Bend {
    vec2 moved;        // D(x)
    mat2 jacobian;     // of x + D(x)
    float determinant; // the product of the parts', which loses nothing where they shear
};

// 1 + grad (w S) of a submap at x + moved, w its weight; w S is added to `moved`.
mat2 bend_of(int level, sampler2D submap, vec4 window, vec2 x, inout vec2 moved) {
    vec2 place = x + moved, size = vec2(textureSize(submap, 0)), density = size / window.zw;
    vec3 at = in_window(window, place);
    mat2 slope;
    vec2 fading;
    float w = weight(level, submap, window, place, fading);
    fading *= vec2(textureSize(u_accumulated, 0)) / u_picture;
    vec2 more = cubic_displacement(submap, at.xy * size, u_walled, slope);
    moved = within_picture(x, moved + w * more * at.z);
    return mat2(1.0) + at.z * (w * mat2(slope[0] * density.x, slope[1] * density.y) + outerProduct(more, fading));
}

// What A, or a closed map, does after that.
void follow(sampler2D accumulated, vec2 x, inout Bend bend) {
    vec2 density = vec2(textureSize(accumulated, 0)) / u_picture;
    mat2 slope;
    bend.moved += cubic_displacement(accumulated, (x + bend.moved) * density, u_walled, slope);
    mat2 next = mat2(1.0) + mat2(slope[0] * density.x, slope[1] * density.y);
    bend.determinant *= determinant(next);
    bend.jacobian = next * bend.jacobian;
}

Bend bend_at(vec2 x) {
    mat2 next;
    Bend bend;
#ifdef HELD
    mat2 slope;
    vec2 density = vec2(textureSize(u_accumulated, 0)) / u_picture;
    // Not on a texel that is held by itself: its slopes would be those to others, which are not kept.
    if (texture(u_held, x / u_picture).r > 0.9) {
        bend.moved = cubic_displacement(u_kept, on_texel(x * density), 0.0, slope);
        bend.jacobian = mat2(1.0) + mat2(slope[0] * density.x, slope[1] * density.y);
        bend.determinant = determinant(bend.jacobian);
        return bend;
    }
#endif
    bend.moved = vec2(0.0);
    bend.jacobian = bend_of(1, u_submap, u_window, x, bend.moved);
    bend.determinant = determinant(bend.jacobian);
#if LEVELS > 1
    next = bend_of(2, u_second, u_second_window, x, bend.moved);
    bend.determinant *= determinant(next);
    bend.jacobian = next * bend.jacobian;
#endif
#if LEVELS > 2
    next = bend_of(4, u_third, u_third_window, x, bend.moved);
    bend.determinant *= determinant(next);
    bend.jacobian = next * bend.jacobian;
#endif
    follow(u_accumulated, x, bend);
#define FOLLOW(closed) bend.moved = within_picture(x, bend.moved); follow(closed, x, bend);
    THROUGH_CLOSED(FOLLOW)
#undef FOLLOW
    return bend;
}
