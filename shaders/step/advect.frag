// Advect: w2(x) = decay * w1(x_d), what departs carried along the trace, each component at its own faces, interpolated by
// the cubic of lib/displacement.glsl; packed 2 x 2 cells a texel as viscosity/operator.glsl has it, 0 on pinned faces.
// u_departing: see depart.frag; u_trace: backtrace of the cell centres, cells; u_decay: exp(-drag dt).
// reads: 57
//
// A face's departure is the mean of those of the two cells it parts. The faces around the departure of u and of v are
// nearly always the same texels, so both are read at once, around the mean departure, and each weighs them for its own
// place; the cubic holds as long as that lies among the four, that is for a strain of up to two cells a step.
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
    // In R what u weighs, in G what v does: by the cubic along x and y, and by the linear along x and y.
    vec4 ux = cubic_lagrange(fu.x), uy = cubic_lagrange(fu.y), vx = cubic_lagrange(fv.x), vy = cubic_lagrange(fv.y);
    vec2 lx = vec2(fu.x, fv.x), ly = vec2(fu.y, fv.y), kx = 1.0 - lx, ky = 1.0 - ly;
    // The departing begin two cells before the grid.
    vec2 first = (corner + 1.5) * texel;
    vec4 x = first.x + vec4(0.0, 1.0, 2.0, 3.0) * texel.x, y = first.y + vec4(0.0, 1.0, 2.0, 3.0) * texel.y;
#define AT(i, j) texture(u_departing, vec2(x[i], y[j])).rg
#define CX(i) vec2(ux[i], vx[i])
#define CY(j) vec2(uy[j], vy[j])
    vec2 bend = CX(1) - kx, bent = CX(2) - lx;
    return (CY(1) * kx + ky * bend) * AT(1, 1) + (CY(1) * lx + ky * bent) * AT(2, 1)
         + (CY(2) * kx + ly * bend) * AT(1, 2) + (CY(2) * lx + ly * bent) * AT(2, 2)
         + ky * (CX(0) * AT(0, 1) + CX(3) * AT(3, 1)) + ly * (CX(0) * AT(0, 2) + CX(3) * AT(3, 2))
         + CY(0) * (kx * AT(1, 0) + lx * AT(2, 0)) + CY(3) * (kx * AT(1, 3) + lx * AT(2, 3));
#undef AT
#undef CX
#undef CY
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
