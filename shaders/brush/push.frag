// Push: make the fluid under the brush move with it, drawn with additive blending.
//   dv = curl psi,  psi = g (dF x r),  dF = strength (v_brush - v_fluid(centre)),  r from the nearest point of the path
// the discrete curl of a stream function at the nodes, so exactly divergence-free; at the path dv = dF
// (regularised dipole; numerics of brushes as in de Goes and James 2017 for the fluid limit).
// u_motion: the fluid's motion at the brush, from probe; u_brush_velocity: lengths / s.
// reads: 1
#include "lib/brush.glsl"
uniform sampler2D u_motion;
uniform vec2 u_brush_velocity;
uniform float u_strength;
uniform float u_h;
layout(location = 0) out vec2 out_velocity;

float stream(vec2 node, vec2 force) {
    vec2 x = node * u_h, r = x - brush_nearest(x);
    return brush_falloff(length(r)) * (force.x * r.y - force.y * r.x);
}

void main() {
    vec2 cell = floor(gl_FragCoord.xy);
    vec2 force = u_strength * (u_brush_velocity - texelFetch(u_motion, ivec2(0), 0).xy);
    float corner = stream(cell, force);
    vec2 velocity = vec2(stream(cell + vec2(0.0, 1.0), force) - corner, corner - stream(cell + vec2(1.0, 0.0), force));
    out_velocity = velocity / u_h * vec2(greaterThan(cell, vec2(0.5)));
}
