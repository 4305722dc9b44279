// Restrain: by how much a push is scaled, into a texel for each image: not at all if the fluid under the brush is left with no
// more than u_most times the energy of the brush's own flow at its own speed, else so that it just comes to that; a push that
// brakes a faster fluid is allowed. Without it a brush drawn to and fro would pump up a fluid without viscosity without end,
// since it looks at two places alone.
//   sum |v + scaling f P|^2 <= max(sum |v|^2, u_most V^2 sum |P|^2)   over the brush, P its flow along f = slip V - v(end)
// u_velocity, u_impulse: MAC faces; u_motion: from probe; u_slip: from slip, in row u_row; u_velocities: the brush's, lengths / s;
// u_strength; u_segments, u_radius, u_spacing: lengths.
// reads: 787
#include "lib/mac.glsl"
#include "lib/brush.glsl"
#include "lib/images.glsl"
uniform sampler2D u_velocity;
uniform sampler2D u_impulse;
uniform sampler2D u_motion;
uniform sampler2D u_slip;
uniform float u_row;
uniform vec2 u_velocities[MOST_IMAGES];
uniform float u_strength;
uniform float u_most;
uniform vec2 u_spacing;
layout(location = 0) out float out_scaling;

const int FINE = 4; // places along the radius

void main() {
    ivec2 image = ivec2(gl_FragCoord.xy);
    vec2 size = vec2(textureSize(u_velocity, 0)), middle = u_segments[image.x].zw, brush = u_velocities[image.x];
    float slip = texelFetch(u_slip, image + ivec2(0, int(u_row)), 0).r;
    vec2 lacking = u_strength * (slip * brush - texelFetch(u_motion, image, 0).xy);
    float far = length(lacking), moving = 0.0, along = 0.0, own = 0.0;
    vec2 direction = lacking / max(far, 1e-20);
    for (int j = -FINE; j <= FINE; ++j)
        for (int i = -FINE; i <= FINE; ++i) {
            vec2 r = vec2(i, j) / float(FINE), p = (middle + r * u_radius) / u_spacing;
            if (dot(r, r) >= 1.0 || any(lessThan(p, vec2(0.0))) || any(greaterThan(p, size))) continue;
            vec2 v = mac_velocity(u_velocity, p) + mac_velocity(u_impulse, p), flow = brush_flow(r, direction);
            moving += dot(v, v);
            along += dot(v, flow);
            own += dot(flow, flow);
        }
    float room = max(u_most * dot(brush, brush) * own - moving, 0.0);
    bool all_of_it = far * (far * own + 2.0 * along) <= room;
    out_scaling = all_of_it ? 1.0 : (sqrt(along * along + own * room) - along) / (far * own);
}
