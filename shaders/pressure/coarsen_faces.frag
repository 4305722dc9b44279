// The faces of the next level. A coarse cell stands for the largest connected part of its block (see lib/block.glsl); the
// face between two of them is as open as its two fine faces are in the mean, but for the distance across, and closed where
// no open fine face joins the two parts.
// in:  u_left, u_up, u_far   faces of the finer level;  u_span   the grid's size in cells of it
// out: left, up, far of the coarser one
// reads: 36
#include "lib/block.glsl"

uniform sampler2D u_left;
uniform sampler2D u_up;
uniform sampler2D u_far;
uniform vec2 u_span;

layout(location = 0) out vec4 out_left;
layout(location = 1) out vec4 out_up;
layout(location = 2) out vec4 out_far;

Faces fine(ivec2 block) {
    if (any(lessThan(block, ivec2(0))) || any(greaterThanEqual(block, textureSize(u_left, 0))))
        return Faces(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    return faces_of(texelFetch(u_left, block, 0), texelFetch(u_up, block, 0), texelFetch(u_far, block, 0));
}

// Openness between two fine faces' cells, `near` of which are members before the face and `after` behind it.
float face(vec2 open, vec2 before, vec2 after) {
    return dot(open, before * after) > 0.0 ? 0.5 * (open.x + open.y) : 0.0;
}
float beside(vec4 before, Faces after) { return face(after.left.xz, before.yw, members(after).xz); }
float below(vec4 before, Faces after) { return face(after.up.xy, before.zw, members(after).xy); }

// A narrow last cell's centre lies nearer: the distance across the first fine faces of coarse cells over the coarse one.
vec2 nearness(vec2 cell) {
    return (1.0 + clamp(u_span - 2.0 * cell, 0.0, 1.0)) / (1.0 + clamp(0.5 * u_span - cell, 0.0, 1.0));
}

void main() {
    ivec2 b = 2 * ivec2(gl_FragCoord.xy);
    Faces f00 = fine(b), f10 = fine(b + ivec2(1, 0)), f01 = fine(b + ivec2(0, 1)), f11 = fine(b + ivec2(1, 1));
    vec4 m00 = members(f00), m10 = members(f10), m01 = members(f01), m11 = members(f11);
    out_left = vec4(beside(members(fine(b + ivec2(-1, 0))), f00), beside(m00, f10),
                    beside(members(fine(b + ivec2(-1, 1))), f01), beside(m01, f11));
    out_up = vec4(below(members(fine(b + ivec2(0, -1))), f00), below(members(fine(b + ivec2(1, -1))), f10),
                  below(m00, f01), below(m10, f11));
    out_far = vec4(beside(m10, fine(b + ivec2(2, 0))), beside(m11, fine(b + ivec2(2, 1))),
                   below(m01, fine(b + ivec2(0, 2))), below(m11, fine(b + ivec2(1, 2))));
    vec2 first = nearness(vec2(b)), second = nearness(vec2(b + 1)), next = nearness(vec2(b + 2));
    out_left *= vec2(first.x, second.x).xyxy;
    out_up *= vec2(first.y, second.y).xxyy;
    out_far *= next.xxyy;
}
