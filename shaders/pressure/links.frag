// Between two levels: which cells of a block its coarse cell stands for, and which coarse cells it is interpolated from.
// in:  u_left, u_up, u_far                        faces of the finer level, whose blocks are the target
//      u_coarse_left, u_coarse_up, u_coarse_far   faces of the coarser level
// out: bits as 8-bit numbers / 255:
//      R  members of the block, bits 0-3
//      G  coarse neighbours that may be interpolated from: left, right, up, down, then left-up, right-up, left-down,
//         right-down, bits 0-7
//      B  for cells that are no members: may take the value of the coarse cell beside (bits 0-3), above or below (4-7)
// reads: 36
#include "lib/block.glsl"

uniform sampler2D u_left;
uniform sampler2D u_up;
uniform sampler2D u_far;
uniform sampler2D u_coarse_left;
uniform sampler2D u_coarse_up;
uniform sampler2D u_coarse_far;

out vec4 out_links;

Faces fine(ivec2 block) {
    if (any(lessThan(block, ivec2(0))) || any(greaterThanEqual(block, textureSize(u_left, 0))))
        return Faces(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    return faces_of(texelFetch(u_left, block, 0), texelFetch(u_up, block, 0), texelFetch(u_far, block, 0));
}

// Which of a coarse cell's left, right, upper, lower faces are open.
bvec4 coarse(ivec2 cell) {
    if (any(lessThan(cell, ivec2(0))) || any(greaterThanEqual(cell, textureSize(u_left, 0)))) return bvec4(false);
    ivec2 block = cell / 2;
    Faces f = faces_of(texelFetch(u_coarse_left, block, 0), texelFetch(u_coarse_up, block, 0),
                       texelFetch(u_coarse_far, block, 0));
    int k = (cell.x & 1) + 2 * (cell.y & 1);
    return greaterThan(vec4(f.left[k], f.right[k], f.up[k], f.down[k]), vec4(0.0));
}

float bits(bvec4 low, bvec4 high) {
    const vec4 place = vec4(1.0, 2.0, 4.0, 8.0);
    return (dot(vec4(low), place) + 16.0 * dot(vec4(high), place)) / 255.0;
}

void main() {
    ivec2 b = ivec2(gl_FragCoord.xy);
    Faces f = fine(b);
    vec4 inside = members(f);
    vec4 l = members(fine(b - ivec2(1, 0))), r = members(fine(b + ivec2(1, 0)));
    vec4 u = members(fine(b - ivec2(0, 1))), d = members(fine(b + ivec2(0, 1)));
    vec4 beside = vec4(f.left.x * l.y, f.right.y * r.x, f.left.z * l.w, f.right.w * r.z);
    vec4 above = vec4(f.up.xy * u.zw, f.down.zw * d.xy);

    // A diagonal neighbour counts only where both ways round to it are open.
    bvec4 here = coarse(b), cl = coarse(b - ivec2(1, 0)), cr = coarse(b + ivec2(1, 0));
    bvec4 cu = coarse(b - ivec2(0, 1)), cd = coarse(b + ivec2(0, 1));
    bvec4 diagonal = bvec4(here.x && here.z && cl.z && cu.x, here.y && here.z && cr.z && cu.y,
                           here.x && here.w && cl.w && cd.x, here.y && here.w && cr.w && cd.y);
    const vec4 zero = vec4(0.0);
    out_links = vec4(bits(greaterThan(inside, zero), bvec4(false)), bits(here, diagonal),
                     bits(greaterThan(beside, zero), greaterThan(above, zero)), 0.0);
}
