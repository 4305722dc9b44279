// Restrict: the residual on the next coarser grid, a quarter of the transpose of prolong.frag.
// u_u, u_v: the fine residual, zero on fixed faces; which coarse faces are open: see openness.glsl,
// with UNIFORM box.glsl.
// Along its normal a face gathers 1/2, 1, 1/2; across it 1/4, 3/4, 3/4, 1/4, or, at free-slip walls, the whole of the two
// that it would share with a fixed neighbour.
// u_alone: 2 where the finer grid is a single column (x) or row (y), which has no other to be joined to: it is coarsened
// along itself only, whatever its walls do, and counts as two; else 1.
// With START a second pair of outputs, the first damped Jacobi sweep on it from rest: u_weight D^-1 times it.
// reads: 29
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform vec2 u_alone;
#include "viscosity/operator.glsl"
#ifdef START
uniform float u_weight;
in vec2 v_uv;
layout(location = 2) out vec4 out_start_u;
layout(location = 3) out vec4 out_start_v;
#endif
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

// Faces of the fine texel at p, v turned so that both components are gathered alike.
vec4 fine(sampler2D f, vec2 p, bool is_v) { return is_v ? texture(f, p).xzyw : texture(f, p); }

// The two coarse columns' sums along the normal, on the upper (xy) and the lower (zw) row of fine texels from `p`.
vec4 along(sampler2D f, vec2 p, vec2 step_along, bool is_v) {
    vec4 a = fine(f, p - step_along, is_v), b = fine(f, p, is_v), c = fine(f, p + step_along, is_v);
    return 0.5 * (vec4(a.y, b.y, a.w, b.w) + vec4(b.y, c.y, b.w, c.w)) + vec4(b.x, c.x, b.z, c.z);
}

// before, here, after: openness (0 or 1) of the coarse faces of this texel, whose first row is `row`, and of those across
// from it; `count` rows lie between the sides that are `no_slip` or not.
vec4 gather(sampler2D f, vec2 p, vec2 step_along, vec2 step_across, bool is_v, vec4 before, vec4 here, vec4 after,
            float row, float count, vec2 no_slip) {
    vec4 a = along(f, p - step_across, step_along, is_v), b = along(f, p, step_along, is_v);
    vec4 c = along(f, p + step_across, step_along, is_v), d = along(f, p + 2.0 * step_across, step_along, is_v);
    vec4 rows = row + vec4(0.0, 0.0, 1.0, 1.0);
    vec4 alone_before = (1.0 - vec4(before.zw, here.xy)) * glides(rows - 1.0, count, no_slip);
    vec4 alone_after = (1.0 - vec4(here.zw, after.xy)) * glides(rows + 1.0, count, no_slip);
    vec4 sum = (0.25 + 0.75 * alone_before) * vec4(a.zw, b.zw) + (0.75 + 0.25 * alone_before) * vec4(b.xy, c.xy)
             + (0.75 + 0.25 * alone_after) * vec4(b.zw, c.zw) + (0.25 + 0.75 * alone_after) * vec4(c.xy, d.xy);
    return 0.25 * u_alone.x * u_alone.y * here * sum;
}

void main() {
    vec2 fine_texel = 1.0 / vec2(textureSize(u_u, 0)), here = own_texel();
    const vec2 x = vec2(1.0, 0.0), y = vec2(0.0, 1.0);
    // The first of this texel's fine texels, past the ring.
    vec2 p = (2.0 * here + 1.5) * fine_texel, fx = x * fine_texel, fy = y * fine_texel;
    vec4 left = open_v(here - x).xzyw, above = open_u(here - y), open_here_u = open_u(here);
    vec4 open_here_v = open_v(here).xzyw, right = open_v(here + x).xzyw, below = open_u(here + y);
    out_u = gather(u_u, p, fx, fy, false, above, open_here_u, below, 2.0 * here.y, u_box.y, sides_across(u_no_slip.zw, u_alone.y));
    out_v = gather(u_v, p, fy, fx, true, left, open_here_v, right, 2.0 * here.x, u_box.x, sides_across(u_no_slip.xy, u_alone.x)).xzyw;
#ifdef START
    Faces inverse = inverse_diagonal(v_uv);
    out_start_u = u_weight * inverse.u * out_u;
    out_start_v = u_weight * inverse.v * out_v;
#endif
}
