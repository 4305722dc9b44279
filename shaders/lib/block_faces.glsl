// The faces of this fragment's block, and the Laplacian over them. For passes whose target is a level's grid of blocks.
// With OPEN there are no solids: the faces follow from u_span, the grid's size in cells of the level; else they are read.
// With WHOLE, besides, that size is whole, and so are all cells.
#include "lib/block.glsl"

uniform sampler2D u_left;
uniform sampler2D u_up;
uniform sampler2D u_far;
uniform vec2 u_span;

in vec2 v_uv;

// One over the distance from the centre of a cell of side 1 to that of the next, of the given side.
vec2 link(vec2 side) { return 2.0 / (1.0 + side); }

// 3 reads; none with OPEN.
Faces faces() {
#ifdef WHOLE
    // Whether there are cells before, in and behind the block's second half.
    vec2 first = 2.0 * floor(gl_FragCoord.xy), near = vec2(greaterThan(first, vec2(0.5)));
    vec2 inner = vec2(greaterThan(u_span, first + 1.5)), far = vec2(greaterThan(u_span, first + 2.5));
    vec4 columns = vec2(1.0, inner.x).xyxy, rows = vec2(1.0, inner.y).xxyy;
    return Faces(rows * vec2(near.x, inner.x).xyxy, rows * vec2(inner.x, far.x).xyxy,
                 columns * vec2(near.y, inner.y).xxyy, columns * vec2(inner.y, far.y).xxyy);
#elif defined(OPEN)
    // The sides of this block's cells and of the next, and how strong the links before, in and behind the block are.
    vec2 first = 2.0 * floor(gl_FragCoord.xy);
    vec2 side = min(u_span - first, 1.0), second = clamp(u_span - first - 1.0, 0.0, 1.0);
    vec2 third = clamp(u_span - first - 2.0, 0.0, 1.0);
    vec2 near = vec2(greaterThan(first, vec2(0.5))) * link(side), inner = sign(second) * link(second);
    vec2 far = sign(third) * link(third);
    vec4 columns = vec2(side.x, second.x).xyxy, rows = vec2(side.y, second.y).xxyy;
    return Faces(rows * vec2(near.x, inner.x).xyxy, rows * vec2(inner.x, far.x).xyxy,
                 columns * vec2(near.y, inner.y).xxyy, columns * vec2(inner.y, far.y).xxyy);
#else
    return faces_of(texture(u_left, v_uv), texture(u_up, v_uv), texture(u_far, v_uv));
#endif
}

// Sum over the faces of openness times the difference across, in the unit of p; `here` is p of this block. 4 reads.
vec4 laplacian(sampler2D p, vec4 here, Faces f) {
    vec4 l = textureOffset(p, v_uv, ivec2(-1, 0)), r = textureOffset(p, v_uv, ivec2(1, 0));
    vec4 u = textureOffset(p, v_uv, ivec2(0, -1)), d = textureOffset(p, v_uv, ivec2(0, 1));
    return f.left * (vec4(l.y, here.x, l.w, here.z) - here) + f.right * (vec4(here.y, r.x, here.w, r.z) - here)
         + f.up * (vec4(u.zw, here.xy) - here) + f.down * (vec4(here.zw, d.xy) - here);
}
