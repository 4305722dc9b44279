// The Jacobian of the warp map by the chain rule: the product of those of its parts, each by the derivatives of what it is
// read by; where something is undone (see `undo` in lib/warp.glsl), that of back + part (x led to - x).
// 24 reads, and 8 more for each of LEVELS above 1, 16 of CLOSED, 4 for each of WEIGHED.
#include "lib/warp.glsl"

// What the map does at x.
struct Bend {
    vec2 moved;        // D(x)
    mat2 jacobian;     // of x + D(x)
    float determinant; // the product of the parts', which loses nothing where they shear
    float between;     // the same, of the submaps and A what becomes of the area of A's next texel, or between its next four
#if UNDONE > 0
    // While closed maps are followed, `moved` and `jacobian` are of where x is led to.
    vec2 from;         // before the last map that was followed
    mat2 before;       // the Jacobian there
    vec2 back;
    mat2 bent_back;    // its slopes along x and y
    float part;
    vec2 fading;       // its slopes
#endif
};

// What becomes of the area of a rectangle whose corners, top left and right, then bottom ones, are moved so, in its sides:
// half the product of its diagonals, negative where it is folded. Of three of them, what turns within it seems to fold.
float area_of(vec2 corners[4]) {
    vec2 down = 1.0 + corners[3] - corners[0], up = vec2(1.0, -1.0) + corners[1] - corners[2];
    return 0.5 * (down.y * up.x - down.x * up.y);
}

// What a submap does at x + moved, with its weight w.
void bend_by(int level, sampler2D submap, vec4 window, vec4 images, vec2 x, inout Bend bend) {
    vec2 place = x + bend.moved, size = cells_of(submap), density = size / window.zw, f;
    vec2 texel = u_picture / vec2(textureSize(u_accumulated, 0));
    vec3 at = in_window(window, place);
    mat2 slope;
    vec2 fading, corners[4];
    float w = weight(level, submap, window, place, fading);
    Nodes nodes = nodes_at(submap, at.xy * size, images, f);
    for (int k = 0; k < 4; ++k) {
        vec2 corner = vec2(k % 2, k / 2);
        corners[k] = at.z * (w + dot(fading, corner)) / texel * between_nodes(nodes, f + corner * texel * density);
    }
    bend.between *= area_of(corners);
    fading /= texel;
    vec2 more = between_nodes(nodes, f, slope);
    bend.moved = within_picture(x, bend.moved + w * more * at.z);
    mat2 next = mat2(1.0) + at.z * (w * mat2(slope[0] * density.x, slope[1] * density.y) + outerProduct(more, fading));
    bend.determinant *= determinant(next);
    bend.jacobian = next * bend.jacobian;
}

// What A, or a closed map, does after that; gives its own determinant.
float follow(sampler2D accumulated, vec4 box, vec4 edges, vec2 x, inout Bend bend) {
    vec2 texels = vec2(textureSize(u_accumulated, 0)) / u_picture, density = texels * box.zw;
    mat2 slope;
#if UNDONE > 0
    bend.from = bend.moved;
    bend.before = bend.jacobian;
#endif
    bend.moved += cubic_displacement(accumulated, ((x + bend.moved) * texels - box.xy) * box.zw, edges, slope);
    mat2 next = mat2(1.0) + mat2(slope[0] * density.x, slope[1] * density.y);
    bend.jacobian = next * bend.jacobian;
    float own = determinant(next);
    bend.determinant *= own;
    return own;
}

void follow_accumulated(vec2 x, inout Bend bend) {
    vec2 density = vec2(textureSize(u_accumulated, 0)) / u_picture, corners[4];
    ivec2 first = clamp(ivec2(floor((x + bend.moved) * density - 0.5)), ivec2(0), textureSize(u_accumulated, 0) - 2);
    for (int k = 0; k < 4; ++k) corners[k] = texelFetch(u_accumulated, first + ivec2(k % 2, k / 2), 0).rg * density;
    bend.between *= area_of(corners);
    follow(u_accumulated, vec4(0.0, 0.0, 1.0, 1.0), u_edges, x, bend);
}

void follow_closed(sampler2D closed, vec4 box, vec4 edges, vec2 x, inout Bend bend) {
    bend.moved = within_picture(x, bend.moved);
    bend.between *= follow(closed, box, edges, x, bend);
}

#if UNDONE > 0
void undo(sampler2D undone, vec4 box, vec4 edges, vec2 x, inout Bend bend) {
    vec2 texels = vec2(textureSize(u_accumulated, 0)) / u_picture, density = texels * box.zw;
    mat2x4 slopes;
    vec4 read = cubic_texels(undone, ((x + bend.from) * texels - box.xy) * box.zw, edges, slopes);
    slopes = mat2x4(slopes[0] * density.x, slopes[1] * density.y) * bend.before;
    mat2 aside = mat2(slopes[0].rg, slopes[1].rg), bent = bend.jacobian - mat2(1.0);
    vec2 growing = vec2(slopes[0].b, slopes[1].b) * float(read.b > 0.0 && read.b < 1.0);
    float kept = 1.0 - clamp(read.b, 0.0, 1.0), left = bend.part * kept;
    vec2 fading = bend.fading * kept - bend.part * growing, moved = bend.moved + clamp(read.rg, -u_picture, u_picture);
    bend.back += bend.part * bend.moved - left * moved;
    bend.bent_back += outerProduct(bend.moved, bend.fading) + bend.part * bent;
    bend.bent_back -= outerProduct(moved, fading) + left * (bent + aside);
    bend.moved = moved;
    bend.part = left;
    bend.fading = fading;
    if (any(notEqual(aside[0], vec2(0.0))) || any(notEqual(aside[1], vec2(0.0)))) {
        bend.jacobian += aside;
        bend.determinant = determinant(bend.jacobian);
    }
}
#endif

Bend bend_at(vec2 x) {
    Bend bend;
#ifdef HELD
    mat2 slope;
    vec2 density = vec2(textureSize(u_accumulated, 0)) / u_picture;
    // Not on a texel that is held by itself: its slopes would be those to others, which are not kept.
    if (texture(u_held, x / u_picture).r > 0.9) {
        bend.moved = cubic_displacement(u_kept, on_texel(x * density), abs(u_edges), slope);
        bend.jacobian = mat2(1.0) + mat2(slope[0] * density.x, slope[1] * density.y);
        bend.determinant = bend.between = determinant(bend.jacobian);
        return bend;
    }
#endif
    bend.moved = vec2(0.0);
#if UNDONE > 0
    bend.back = bend.fading = vec2(0.0);
    bend.bent_back = mat2(0.0);
    bend.part = 1.0;
#endif
    bend.jacobian = mat2(1.0);
    bend.determinant = bend.between = 1.0;
    bend_by(1, u_submap, u_window, u_images, x, bend);
#if LEVELS > 1
    bend_by(2, u_second, u_second_window, u_second_images, x, bend);
#endif
#if LEVELS > 2
    bend_by(4, u_third, u_third_window, u_third_images, x, bend);
#endif
    follow_accumulated(x, bend);
#define UNDO(closed, box, edges) undo(closed, box, edges, x, bend)
#define GO_ON(closed, box, edges) follow_closed(closed, box, edges, x, bend)
#if UNDONE > 0
#define FOLLOW(closed, box, edges, n) if (IS_UNDONE(n)) UNDO(closed, box, edges); else GO_ON(closed, box, edges);
#else
#define FOLLOW(closed, box, edges, n) GO_ON(closed, box, edges);
#endif
    THROUGH_CLOSED(FOLLOW)
#undef FOLLOW
#undef GO_ON
#undef UNDO
#if UNDONE > 0
    // Where nothing is undone, the determinant stays the product of the parts'. At a sharp edge the cubic leads on, by E,
    // also where the part T, kept in 0-1, is 0.
    if (bend.part < 1.0 || bend.back != vec2(0.0) || bend.bent_back != mat2(0.0)) {
        mat2 bent = bend.bent_back + outerProduct(bend.moved, bend.fading) + bend.part * (bend.jacobian - mat2(1.0));
        bend.jacobian = mat2(1.0) + bent;
        bend.determinant = bend.between = determinant(bend.jacobian);
        bend.moved = bend.back + bend.part * bend.moved;
    }
#endif
    return bend;
}
