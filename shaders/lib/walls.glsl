// The edges of the picture, written once, as what they do to the weights of an interpolation: a face beyond an edge counts
// as its mirror image inside, of the sign that makes
//   the normal component      zero on the wall and odd beyond it;
//   the tangential component  even beyond a free-slip wall, and 2 U minus its image beyond a no-slip one that moves
//                             along itself at speed U.
// Define NO_SLIP for the latter; u_wall_speed holds U of the left, right, top and bottom wall, lengths / s.
// Textures are clamped to the edge, and what is looked up lies in the grid, so a pair of faces reaches one beyond an edge
// at most, where the clamp finds the image by itself; four of them reach two beyond, and their weights are folded back.

#ifdef NO_SLIP
uniform vec4 u_wall_speed;
const float IMAGE = -1.0;
#else
const vec4 u_wall_speed = vec4(0.0);
const float IMAGE = 1.0;
#endif

// Weights of two normal faces from `first` on; face 0 and face `count`, which is not stored, are the walls.
vec2 wall_normal(vec2 weights, float first, float count) {
    return weights * vec2(lessThan(abs(2.0 * vec2(first, first + 1.0) - count), vec2(count)));
}

// Weights of two tangential faces from `first` on, `count` of them between the walls; `added` is what walls that move at
// `speed` (near, far) add, to be multiplied by the sum of the weights in the other direction.
vec2 wall_tangential(vec2 weights, float first, float count, vec2 speed, out float added) {
    vec2 beyond = vec2(first < 0.0, first + 1.0 >= count);
    added = (1.0 - IMAGE) * dot(speed * beyond, weights);
    return weights * (1.0 + (IMAGE - 1.0) * beyond);
}

// Four weights w of faces -1 ... 2 around `corner` by the near wall, tangential: -1 counts as 0 and -2 as 1.
vec4 fold_tangential(vec4 w, float corner) {
    float near = float(corner == 0.0), beyond = float(corner < 0.0);
    return vec4(w.x * (1.0 - near - beyond), w.y * (1.0 - beyond) + IMAGE * near * w.x, w.zw + IMAGE * beyond * w.yx);
}

// The same, normal: -1 counts as minus 1; -2 hardly weighs anything and is left out.
vec4 fold_normal(vec4 w, float corner) {
    float near = float(corner == 0.0), beyond = float(corner < 0.0);
    return vec4(w.x * (1.0 - near - beyond), w.y * (1.0 - beyond), w.z - near * w.x, w.w - beyond * w.y);
}

// Weights of four normal faces, from `corner` - 1 on.
vec4 wall_normal(vec4 weights, float corner, float count) {
    weights = fold_normal(fold_normal(weights, corner).wzyx, count - 1.0 - corner).wzyx;
    return weights * vec4(lessThan(abs(2.0 * corner + vec4(-2.0, 0.0, 2.0, 4.0) - count), vec4(count)));
}

// Weights of four tangential faces, from `corner` - 1 on; `added` as above.
vec4 wall_tangential(vec4 weights, float corner, float count, vec2 speed, out float added) {
    vec4 index = corner + vec4(-1.0, 0.0, 1.0, 2.0);
    added = (1.0 - IMAGE) * (speed.x * dot(weights, vec4(lessThan(index, vec4(0.0))))
                           + speed.y * dot(weights, vec4(greaterThan(index, vec4(count - 1.0)))));
    return fold_tangential(fold_tangential(weights, corner).wzyx, count - 2.0 - corner).wzyx;
}
