// Velocity on the MAC grid: u on left faces in R, v on upper faces in G (see CONTRIBUTING.md).
#include "lib/walls.glsl"

// Velocity at position p (in cells, (0,0) the top left corner of the grid), each component bilinear between its faces.
// 8 reads, by texture() with nearest filtering: exact at texel centres, and cheaper than texelFetch in software.
vec2 mac_velocity(sampler2D velocity, vec2 p) {
    vec2 size = vec2(textureSize(velocity, 0)), texel = 1.0 / size;
    // u lives at (i, j + .5), v at (i + .5, j).
    vec2 qu = p - vec2(0.0, 0.5), qv = p - vec2(0.5, 0.0);
    vec2 cu = floor(qu), cv = floor(qv), fu = qu - cu, fv = qv - cv;
    float add_u, add_v;
    vec2 ux = wall_normal(vec2(1.0 - fu.x, fu.x), cu.x, size.x);
    vec2 uy = wall_tangential(vec2(1.0 - fu.y, fu.y), cu.y, size.y, u_wall_image.zw, u_wall_speed.zw, add_u);
    vec2 vx = wall_tangential(vec2(1.0 - fv.x, fv.x), cv.x, size.x, u_wall_image.xy, u_wall_speed.xy, add_v);
    vec2 vy = wall_normal(vec2(1.0 - fv.y, fv.y), cv.y, size.y);
    vec4 tu = vec4(cu + 0.5, cu + 1.5) * texel.xyxy, tv = vec4(cv + 0.5, cv + 1.5) * texel.xyxy;
    vec4 u = vec4(texture(velocity, tu.xy).r, texture(velocity, tu.zy).r,
                  texture(velocity, tu.xw).r, texture(velocity, tu.zw).r);
    vec4 v = vec4(texture(velocity, tv.xy).g, texture(velocity, tv.zy).g,
                  texture(velocity, tv.xw).g, texture(velocity, tv.zw).g);
    vec2 moved = vec2(add_u * (ux.x + ux.y), add_v * (vy.x + vy.y));
    return vec2(dot(u, vec4(ux * uy.x, ux * uy.y)), dot(v, vec4(vx * vy.x, vx * vy.y))) + moved;
}

// Velocity at the centre of the cell at p (in cells), the mean of opposite faces: of its own, and of those to the right
// and below, which are at rest where they are the grid's edge. 3 reads.
vec2 mac_centre(sampler2D velocity, vec2 p) {
    vec2 size = vec2(textureSize(velocity, 0)), texel = 1.0 / size, uv = p * texel;
    vec2 beyond = vec2(texture(velocity, uv + vec2(texel.x, 0.0)).r, texture(velocity, uv + vec2(0.0, texel.y)).g);
    return 0.5 * (texture(velocity, uv).rg + beyond * vec2(lessThan(p + 1.0, size)));
}

// Where the fluid at position p (in cells) was one step ago, as x_d - x: second-order (midpoint) backtrace, kept in the grid.
// It is made in two halves where the velocity changes much along the way: else quick pushes, of a brush's radius a step,
// fold what they pass. Distances are summed up, not places: a place 32 cells from the corner is rounded by 2e-6 cells in
// every step, and where the flow stretches a corner of the picture ten-thousandfold, that error grows as much.
// `here` is the velocity at p; `cells_a_speed` is dt / spacing. 8 reads, and 24 more in two halves. The velocity is read at
// one place of a loop: a rasteriser that draws several fragments at once runs both sides of an `if`, but leaves a loop when
// all fragments have.
const float BENT = 0.5; // change of the velocity, cells a step, from which on halves are blended in; twice as much: only halves

// With PARTS the trace is made in u_parts equal parts everywhere, as many as the steepest gradient needs: a blend between one
// and two would be a step in the trace, which a local push, steeper than any flow, folds. 16 reads for each.
#ifdef PARTS
uniform float u_parts;

vec2 mac_backtrace(sampler2D velocity, vec2 p, vec2 here, vec2 cells_a_speed) {
    vec2 edge = vec2(textureSize(velocity, 0)), along = cells_a_speed / u_parts, back = vec2(0.0);
    for (float part = 0.0; part < u_parts; ++part) {
        vec2 at = p + clamp(back - 0.5 * along * here, -p, edge - p);
        back = clamp(back - along * mac_velocity(velocity, at), -p, edge - p);
        if (part < u_parts - 1.0) here = mac_velocity(velocity, p + back);
    }
    return back;
}
#else
vec2 mac_backtrace(sampler2D velocity, vec2 p, vec2 here, vec2 cells_a_speed) {
    vec2 edge = vec2(textureSize(velocity, 0));
    vec2 begun = vec2(0.0), at = clamp(-0.5 * cells_a_speed * here, -p, edge - p), once;
    float bent = 0.0;
    for (int look = 0; look < 4; ++look) { // in the middle of the whole; of the first half, where it ends, of the second
        vec2 found = mac_velocity(velocity, p + at);
        if (look == 0) {
            once = clamp(-cells_a_speed * found, -p, edge - p);
            bent = smoothstep(BENT, 2.0 * BENT, length(cells_a_speed * (found - here)));
            if (bent == 0.0) break;
            found = here;
        }
        bool ends = look % 2 == 1;
        at = clamp(begun - (ends ? 0.5 : 0.25) * cells_a_speed * found, -p, edge - p);
        if (ends) begun = at;
    }
    return mix(once, at, bent);
}
#endif

// The same from the centre of the cell at p. 11 reads, and 24 more in two halves.
vec2 mac_trace(sampler2D velocity, vec2 p, vec2 cells_a_speed) {
    return mac_backtrace(velocity, p, mac_centre(velocity, p), cells_a_speed);
}
