// Advect: w2(x) = decay * w1(x_d), what departs carried along the trace, each component at its own faces, interpolated by a
// four-point cubic in both directions; packed 2 x 2 cells a texel as viscosity/block.glsl has it, 0 on pinned faces.
// u_departing: see depart.frag; u_trace: backtrace of the cell centres, cells; u_decay: exp(-drag dt).
// reads: 41
//
// A face's departure is the mean of those of the two cells it parts. The 4 x 4 faces around the departure of u and of v
// are nearly always the same texels, so both are read at once, around the mean departure, and each weighs them for its
// own place; the cubic holds as long as that lies among the four, that is for a strain of up to two cells a step.
#include "lib/cubic.glsl"
#ifdef UNIFORM
#include "viscosity/box.glsl"
#else
#include "viscosity/openness.glsl"
#endif
uniform sampler2D u_departing;
uniform sampler2D u_trace;
uniform float u_decay;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

vec2 arriving(vec2 cell, vec2 to_u, vec2 to_v, vec2 texel) {
    vec2 corner = floor(cell + 0.5 * (to_u + to_v));
    vec2 fu = clamp(cell + to_u - corner, -1.0, 2.0), fv = clamp(cell + to_v - corner, -1.0, 2.0);
    vec4 ux = cubic_lagrange(fu.x), uy = cubic_lagrange(fu.y), vx = cubic_lagrange(fv.x), vy = cubic_lagrange(fv.y);
    // The departing begin two cells before the grid.
    vec2 first = (corner + 1.5) * texel;
    float after = first.x + 2.0 * texel.x;
    vec2 sum = vec2(0.0);
    for (int j = 0; j < 4; ++j) {
        float y = first.y + float(j) * texel.y;
        vec4 a = texture(u_departing, vec2(first.x, y)), b = texture(u_departing, vec2(after, y));
        sum += vec2(uy[j] * (dot(ux.xy, a.xz) + dot(ux.zw, b.xz)), vy[j] * (dot(vx.xy, a.yw) + dot(vx.zw, b.yw)));
    }
    return sum;
}

void main() {
    vec2 cell = 2.0 * own_texel(), texel = 1.0 / vec2(textureSize(u_departing, 0)), x = vec2(1.0, 0.0), y = vec2(0.0, 1.0);
    vec2 pace = 1.0 / vec2(textureSize(u_trace, 0)), here = (cell + 0.5) * pace;
    vec4 columns = vec4(here.x - pace.x, here.x, here.x + pace.x, 0.0), lines = vec4(here.y - pace.y, here.y, here.y + pace.y, 0.0);
#define BACK(i, j) texture(u_trace, vec2(columns[i], lines[j])).rg
    vec2 a = BACK(1, 1), b = BACK(2, 1), c = BACK(1, 2), d = BACK(2, 2);
    vec2 p = arriving(cell, 0.5 * (a + BACK(0, 1)), 0.5 * (a + BACK(1, 0)), texel);
    vec2 q = arriving(cell + x, 0.5 * (b + a), 0.5 * (b + BACK(2, 0)), texel);
    vec2 r = arriving(cell + y, 0.5 * (c + BACK(0, 2)), 0.5 * (c + a), texel);
    vec2 s = arriving(cell + 1.0, 0.5 * (d + c), 0.5 * (d + b), texel);
#undef BACK
    out_u = u_decay * vec4(p.x, q.x, r.x, s.x) * open_u(own_texel());
    out_v = u_decay * vec4(p.y, q.y, r.y, s.y) * open_v(own_texel());
}
