// Resample: the velocity on the faces of a grid, from that on those of another grid of the same picture: the mean of
// u_samples places along a face, bilinear, and at rest outside the other grid.
// u_velocity: MAC faces, lengths / s; u_origin: where this grid begins on the other one, in its cells; u_step: this grid's
// cells in its cells.
// reads: 16
#include "lib/mac.glsl"
uniform sampler2D u_velocity;
uniform vec2 u_origin;
uniform vec2 u_step;
uniform vec2 u_samples; // along v's faces, and along u's
layout(location = 0) out vec2 out_velocity;

vec2 velocity_at(vec2 p) {
    vec2 size = vec2(textureSize(u_velocity, 0));
    return any(lessThan(p, vec2(0.0))) || any(greaterThan(p, size)) ? vec2(0.0) : mac_velocity(u_velocity, p);
}

void main() {
    vec2 corner = floor(gl_FragCoord.xy);
    out_velocity = vec2(0.0);
    for (float k = 0.5; k < u_samples.y; k += 1.0)
        out_velocity.x += velocity_at(u_origin + u_step * (corner + vec2(0.0, k / u_samples.y))).x / u_samples.y;
    for (float k = 0.5; k < u_samples.x; k += 1.0)
        out_velocity.y += velocity_at(u_origin + u_step * (corner + vec2(k / u_samples.x, 0.0))).y / u_samples.x;
    // The grid's own first faces are walls.
    out_velocity *= vec2(greaterThan(corner, vec2(0.0)));
}
