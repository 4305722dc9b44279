// Advect: w2(x) = decay w1(x - dt w1(x)), semi-Lagrangian (paper section 3.2, second stage), each component at its own
// faces, interpolated by a four-point cubic in both directions.
// u_departing (w1): MAC faces, lengths / s, in RG, those of the cell to the right in BA; u_trace: backtrace of the cell
// centres, cells; u_decay: exp(-drag dt).
// reads: 11
//
// A face's departure is the mean of those of the two cells it parts. The 4 x 4 faces around the departure of u and of v
// are nearly always the same texels, so both are read at once, around the mean departure, and each weighs them for its
// own place; the cubic holds as long as that lies among the four, that is for a strain of up to two cells a step.
#include "lib/cubic.glsl"
#include "lib/walls.glsl"
uniform sampler2D u_departing;
uniform sampler2D u_trace;
uniform float u_decay;
in vec2 v_uv;
layout(location = 0) out vec2 out_velocity;

void main() {
    vec2 size = vec2(textureSize(u_departing, 0)), texel = 1.0 / size, cell = floor(gl_FragCoord.xy);
    vec2 here = texture(u_trace, v_uv).rg;
    vec2 to_u = 0.5 * (here + texture(u_trace, v_uv - vec2(texel.x, 0.0)).rg);
    vec2 to_v = 0.5 * (here + texture(u_trace, v_uv - vec2(0.0, texel.y)).rg);
    vec2 corner = floor(cell + 0.5 * (to_u + to_v));
    vec2 fu = clamp(cell + to_u - corner, -1.0, 2.0), fv = clamp(cell + to_v - corner, -1.0, 2.0);
    float add_u, add_v;
    vec4 ux = wall_normal(cubic_lagrange(fu.x), corner.x, size.x);
    vec4 uy = wall_tangential(cubic_lagrange(fu.y), corner.y, size.y, u_wall_speed.zw, add_u);
    vec4 vx = wall_tangential(cubic_lagrange(fv.x), corner.x, size.x, u_wall_speed.xy, add_v);
    vec4 vy = wall_normal(cubic_lagrange(fv.y), corner.y, size.y);
    float before = (corner.x - 0.5) * texel.x, after = (corner.x + 1.5) * texel.x;
    vec4 y = (corner.y + vec4(-0.5, 0.5, 1.5, 2.5)) * texel.y;
    vec2 sum = vec2(add_u * dot(ux, vec4(1.0)), add_v * dot(vy, vec4(1.0)));
    for (int j = 0; j < 4; ++j) {
        vec4 a = texture(u_departing, vec2(before, y[j])), b = texture(u_departing, vec2(after, y[j]));
        // Beyond the edge the pair itself has been clamped, not the two faces.
        a.zw = corner.x == 0.0 ? a.xy : a.zw;
        sum += vec2(uy[j] * (dot(ux.xy, a.xz) + dot(ux.zw, b.xz)), vy[j] * (dot(vx.xy, a.yw) + dot(vx.zw, b.yw)));
    }
    // The near walls' faces stay at zero.
    out_velocity = u_decay * sum * vec2(greaterThan(cell, vec2(0.5)));
}
