// The edges of the picture, written once, as what they do to the weights of an interpolation. Textures are clamped to the
// edge, so a face beyond an edge reads as the nearest one inside, and the weights make it what it ought to be:
//   normal component:      zero on a wall and beyond it: such faces are given no weight.
//   tangential component:  the same as inside at a free-slip wall (the clamp does that); 2 U - inside at a no-slip one
//                          that moves at speed U: weight of opposite sign, and 2 U times the weight on top.
// Define NO_SLIP for the latter; u_wall_speed holds U of the left, right, top and bottom wall, lengths / s.

// Weights of normal faces `index`, of which there are `count` before the far wall.
vec2 wall_normal(vec2 weights, vec2 index, float count) {
    return weights * vec2(lessThan(abs(2.0 * index - count), vec2(count)));
}
vec4 wall_normal(vec4 weights, vec4 index, float count) {
    return weights * vec4(lessThan(abs(2.0 * index - count), vec4(count)));
}

#ifdef NO_SLIP
uniform vec4 u_wall_speed;

vec2 wall_before(vec2 index) { return vec2(lessThan(index, vec2(0.0))); }
vec4 wall_before(vec4 index) { return vec4(lessThan(index, vec4(0.0))); }

// Weights of tangential faces `index`, and in `added` what moving walls of `speed` (near, far) add, to be multiplied by
// the sum of the weights in the other direction.
vec2 wall_tangential(vec2 weights, vec2 index, float count, vec2 speed, out float added) {
    vec2 near = wall_before(index), far = wall_before(count - 1.0 - index);
    added = 2.0 * (speed.x * dot(weights, near) + speed.y * dot(weights, far));
    return weights * (1.0 - 2.0 * (near + far));
}
vec4 wall_tangential(vec4 weights, vec4 index, float count, vec2 speed, out float added) {
    vec4 near = wall_before(index), far = wall_before(count - 1.0 - index);
    added = 2.0 * (speed.x * dot(weights, near) + speed.y * dot(weights, far));
    return weights * (1.0 - 2.0 * (near + far));
}
#else
const vec4 u_wall_speed = vec4(0.0);
vec2 wall_tangential(vec2 weights, vec2 index, float count, vec2 speed, out float added) {
    added = 0.0;
    return weights;
}
vec4 wall_tangential(vec4 weights, vec4 index, float count, vec2 speed, out float added) {
    added = 0.0;
    return weights;
}
#endif
