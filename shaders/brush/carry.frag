// Carry: the local part of a push, b F and nothing beside it, drawn with additive blending; less its image beyond a wall
// that it pushes at or from, so that it comes to rest there smoothly.
// u_motion: the fluid at the brush, from probe; u_slip: from slip; u_brush_velocity: lengths / s, the local part of it;
// u_viscosity: cells, lengths^2 / s: what is thicker than at the brush is carried less.
// With SOLIDS: u_solid, cells, how far they are closed; towards and away from these less and less within the radius, or all
// that is pushed at one would be pressed into the last cell before it.
// reads: 5, and 580 with SOLIDS
#include "lib/brush.glsl"
uniform sampler2D u_motion;
uniform sampler2D u_slip;
uniform sampler2D u_viscosity;
uniform vec2 u_brush_velocity;
uniform vec2 u_spacing;
in vec2 v_uv;
#ifdef SOLIDS
uniform sampler2D u_solid;

// What is left of a motion at a place (cells) near closed cells: their direction and nearness from a lattice of them.
vec2 beside_solids(vec2 place, vec2 motion) {
    vec2 reach = u_radius / u_spacing, apart = max(ceil(reach / 6.0), 1.0);
    vec2 size = vec2(textureSize(u_solid, 0)), first = apart * ceil((place - reach) / apart), cell, towards = vec2(0.0);
    float nearest = 0.0;
    for (cell.y = first.y; cell.y < place.y + reach.y; cell.y += apart.y)
        for (cell.x = first.x; cell.x < place.x + reach.x; cell.x += apart.x) {
            vec2 away = (cell + 0.5 - place) / reach;
            float near = max(1.0 - length(away), 0.0) * texture(u_solid, (cell + 0.5) / size).r, weight = near * near;
            nearest = max(nearest, near);
            towards += weight * weight * away;
        }
    towards /= max(length(towards), 1e-20);
    return motion - nearest * dot(motion, towards) * towards;
}
#endif
layout(location = 0) out vec2 out_velocity;

void main() {
    vec2 p = gl_FragCoord.xy, texel = 1.0 / vec2(textureSize(u_viscosity, 0));
    vec2 u = (p - vec2(0.5, 0.0)) * u_spacing, v = (p - vec2(0.0, 0.5)) * u_spacing, far = 2.0 * u_spacing / texel;
    vec2 weight = vec2(brush_weight(u) - brush_weight(vec2(-u.x, u.y)) - brush_weight(vec2(far.x - u.x, u.y)),
                       brush_weight(v) - brush_weight(vec2(v.x, -v.y)) - brush_weight(vec2(v.x, far.y - v.y)));
    vec2 before = vec2(texture(u_viscosity, v_uv - vec2(texel.x, 0.0)).r, texture(u_viscosity, v_uv - vec2(0.0, texel.y)).r);
    vec2 thickest = max(max(before, texture(u_viscosity, v_uv).r), 1e-9);
    vec2 attenuation = min(max(texelFetch(u_motion, ivec2(0), 0).w, 1e-9) / thickest, 1.0);
    vec2 motion = u_brush_velocity;
#ifdef SOLIDS
    if (max(weight.x, weight.y) > 0.0)
        motion = vec2(beside_solids(p - vec2(0.5, 0.0), motion).x, beside_solids(p - vec2(0.0, 0.5), motion).y);
#endif
    out_velocity = texelFetch(u_slip, ivec2(0), 0).r * attenuation * max(weight, 0.0) * motion
                 * vec2(greaterThan(p, vec2(1.0)));
}
