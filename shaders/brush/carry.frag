// Carry: the local part of a push, b F and nothing beside it, drawn with additive blending; less its image beyond a wall
// that it pushes at or from, so that it comes to rest there smoothly.
// u_motion: the fluid at the brush, from probe; u_slip: from slip; u_brush_velocity: lengths / s, the local part of it;
// u_viscosity: cells, lengths^2 / s: what is thicker than at the brush is carried less.
// reads: 5
#include "lib/brush.glsl"
uniform sampler2D u_motion;
uniform sampler2D u_slip;
uniform sampler2D u_viscosity;
uniform vec2 u_brush_velocity;
uniform vec2 u_spacing;
in vec2 v_uv;
layout(location = 0) out vec2 out_velocity;

void main() {
    vec2 p = gl_FragCoord.xy, texel = 1.0 / vec2(textureSize(u_viscosity, 0));
    vec2 u = (p - vec2(0.5, 0.0)) * u_spacing, v = (p - vec2(0.0, 0.5)) * u_spacing, far = 2.0 * u_spacing / texel;
    vec2 weight = vec2(brush_weight(u) - brush_weight(vec2(-u.x, u.y)) - brush_weight(vec2(far.x - u.x, u.y)),
                       brush_weight(v) - brush_weight(vec2(v.x, -v.y)) - brush_weight(vec2(v.x, far.y - v.y)));
    vec2 before = vec2(texture(u_viscosity, v_uv - vec2(texel.x, 0.0)).r, texture(u_viscosity, v_uv - vec2(0.0, texel.y)).r);
    vec2 thickest = max(max(before, texture(u_viscosity, v_uv).r), 1e-9);
    vec2 attenuation = min(max(texelFetch(u_motion, ivec2(0), 0).w, 1e-9) / thickest, 1.0);
    out_velocity = texelFetch(u_slip, ivec2(0), 0).r * attenuation * max(weight, 0.0) * u_brush_velocity
                 * vec2(greaterThan(p, vec2(1.0)));
}
