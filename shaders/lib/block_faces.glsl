// The faces of this fragment's block, and the Laplacian over them. For passes whose target is a level's grid of blocks.
#include "lib/block.glsl"

uniform sampler2D u_left;
uniform sampler2D u_up;
uniform sampler2D u_far;

in vec2 v_uv;

// 3 reads.
Faces faces() { return faces_of(texture(u_left, v_uv), texture(u_up, v_uv), texture(u_far, v_uv)); }

// Sum over the faces of openness times the difference across, in the unit of p; `here` is p of this block. 4 reads.
vec4 laplacian(sampler2D p, vec4 here, Faces f) {
    vec4 l = textureOffset(p, v_uv, ivec2(-1, 0)), r = textureOffset(p, v_uv, ivec2(1, 0));
    vec4 u = textureOffset(p, v_uv, ivec2(0, -1)), d = textureOffset(p, v_uv, ivec2(0, 1));
    return f.left * (vec4(l.y, here.x, l.w, here.z) - here) + f.right * (vec4(here.y, r.x, here.w, r.z) - here)
         + f.up * (vec4(u.zw, here.xy) - here) + f.down * (vec4(here.zw, d.xy) - here);
}
