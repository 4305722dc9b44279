// The edges of the picture, written once, as what they do to the weights of an interpolation: a face beyond an edge counts
// as its mirror image inside, of the sign that makes
//   the normal component      zero on the wall and odd beyond it;
//   the tangential component  even beyond a free-slip wall, and 2 U minus its image beyond a no-slip one that moves
//                             along itself at speed U.
// Define NO_SLIP if some side is of the latter kind; of the left, right, top and bottom wall u_wall_speed holds U, lengths
// / s, and u_wall_image the sign of the tangential image: 1 at a free-slip wall, -1 at a no-slip one.
// Textures are clamped to the edge, and what is looked up lies in the grid, so a pair of faces reaches one beyond an edge
// at most, where the clamp finds the image by itself. What is read by fours reaches two beyond, and is laid out with the
// images in place: see `image_normal`.

#ifdef NO_SLIP
uniform vec4 u_wall_speed;
uniform vec4 u_wall_image;
#else
const vec4 u_wall_speed = vec4(0.0);
const vec4 u_wall_image = vec4(1.0);
#endif

// Weights of two normal faces from `first` on; face 0 and face `count`, which is not stored, are the walls.
vec2 wall_normal(vec2 weights, float first, float count) {
    return weights * vec2(lessThan(abs(2.0 * vec2(first, first + 1.0) - count), vec2(count)));
}

// Weights of two tangential faces from `first` on, `count` of them between the walls (near, far) with these images;
// `added` is what those add that move at `speed`, to be multiplied by the sum of the weights in the other direction.
vec2 wall_tangential(vec2 weights, float first, float count, vec2 image, vec2 speed, out float added) {
    vec2 beyond = vec2(first < 0.0, first + 1.0 >= count);
    added = dot((1.0 - image) * speed * beyond, weights);
    return weights * (1.0 + (image - 1.0) * beyond);
}

// The normal face whose image the one at `index` is, of `count` between and on the walls, and what it counts there.
float image_normal(float index, float count, out float sign) {
    float image = abs(index);
    image = min(image, 2.0 * count - image);
    sign = image == 0.0 || image == count ? 0.0 : index == image ? 1.0 : -1.0;
    return image;
}

// The same of a tangential one, which counts `sign` times and `added`.
float image_tangential(float index, float count, vec2 image, vec2 speed, out float sign, out float added) {
    bool before = index < 0.0, after = index >= count;
    sign = before ? image.x : after ? image.y : 1.0;
    added = (1.0 - sign) * (before ? speed.x : after ? speed.y : 0.0);
    return before ? -1.0 - index : after ? 2.0 * count - 1.0 - index : index;
}
