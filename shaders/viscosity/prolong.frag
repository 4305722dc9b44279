// Prolong: the coarse correction on the finer grid, added to the iterate, f + P e; CORRECTION: P e alone.
// u_coarse_u, u_coarse_v: coarse faces e; u_u, u_v: the iterate f.
// Linear along the face's normal; 3/4 and 1/4 of the two nearest across it. A coarse face that is exactly zero is
// fixed (or at rest, which makes no difference): at free-slip walls the other one then counts whole.
// u_alone: see restrict.frag.
// reads: 12
#include "viscosity/operator.glsl"
uniform sampler2D u_coarse_u;
uniform sampler2D u_coarse_v;
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform vec2 u_alone;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

vec4 coarse(sampler2D f, vec2 p, bool is_v) { return is_v ? texture(f, p).xzyw : texture(f, p); }

// Between the nearest coarse face and the next one; what each is glided along for, if it is fixed.
vec4 across(vec4 nearest, vec4 next, vec4 glides_nearest, vec4 glides_next) {
    vec4 alone = max(vec4(equal(nearest, vec4(0.0))) * glides_nearest, vec4(equal(next, vec4(0.0))) * glides_next);
    return mix(0.75 * nearest + 0.25 * next, nearest + next, alone);
}

// The texel's four faces. `odd` says whether it is the second fine texel of the coarse one at p, along and across; `row`
// is the first coarse row of that one, `count` of them lie between the sides that are `no_slip` or not.
vec4 spread(sampler2D f, vec2 p, vec2 step_along, vec2 step_across, bool is_v, bool odd_along, bool odd_across,
            float row, float count, vec2 no_slip) {
    vec2 q = p + (odd_across ? step_across : -step_across);
    vec4 a = coarse(f, p, is_v), b = coarse(f, p + step_along, is_v);
    vec4 c = coarse(f, q, is_v), d = coarse(f, q + step_along, is_v);
    // Coarse faces on the texel's left and right side, by rows: xy of this coarse texel, zw of the one across.
    vec4 first = odd_along ? vec4(a.y, a.w, c.y, c.w) : vec4(a.x, a.z, c.x, c.z);
    vec4 second = odd_along ? vec4(b.x, b.z, d.x, d.z) : vec4(a.y, a.w, c.y, c.w);
    // Rows before, here and after.
    vec3 near = odd_across ? first.xyz : first.wxy, far = odd_across ? second.xyz : second.wxy;
    float before = row - (odd_across ? 0.0 : 1.0);
    vec4 glides_next = glides(before + vec4(0.0, 2.0, 0.0, 2.0), count, no_slip);
    vec4 rows = across(vec4(near.yy, far.yy), vec4(near.xz, far.xz), glides(vec4(before + 1.0), count, no_slip), glides_next);
    return vec4(rows.x, 0.5 * (rows.x + rows.z), rows.y, 0.5 * (rows.y + rows.w));
}

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy) - 1;
    bvec2 odd = equal(place & 1, ivec2(1));
    vec2 texel = 1.0 / vec2(textureSize(u_coarse_u, 0)), p = (vec2(place >> 1) + 1.5) * texel;
    vec2 first = vec2(place >> 1) * 2.0, box = floor(0.5 * u_box);
    vec2 x = vec2(texel.x, 0.0), y = vec2(0.0, texel.y);
    out_u = open_u(own_texel()) * spread(u_coarse_u, p, x, y, false, odd.x, odd.y, first.y, box.y, sides_across(u_no_slip.zw, u_alone.y));
    out_v = open_v(own_texel()) * spread(u_coarse_v, p, y, x, true, odd.y, odd.x, first.x, box.x, sides_across(u_no_slip.xy, u_alone.x)).xzyw;
#ifndef CORRECTION
    out_u += texture(u_u, v_uv);
    out_v += texture(u_v, v_uv);
#endif
}
