// The faces of this fragment's block, and the Laplacian over them. For passes whose target is a level's grid of blocks.
// With OPEN there are no solids, and the faces follow from u_cells, the level's size in cells; else they are read.
#include "lib/block.glsl"

uniform sampler2D u_left;
uniform sampler2D u_up;
uniform sampler2D u_far;
uniform vec2 u_cells;

in vec2 v_uv;

// 3 reads; none with OPEN.
Faces faces() {
#ifdef OPEN
    vec2 first = 2.0 * floor(gl_FragCoord.xy);
    vec2 near = vec2(greaterThan(first, vec2(0.5)));
    vec2 inner = vec2(lessThan(first + 1.0, u_cells)), far = vec2(lessThan(first + 2.0, u_cells));
    vec4 columns = vec2(1.0, inner.x).xyxy, rows = vec2(1.0, inner.y).xxyy;
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
