// Scaling: how near scaling the displacement F by anything from 0 to 1 comes to a fold, -min det(1 + a grad F) over all a, of
// the smaller one of 1 and det(1 + grad F); -1 where that folds. To be reduced to the largest.
// u_factor (F): over the whole picture, longer sides; u_picture: its width and height, longer sides.
// reads: 16
#include "lib/displacement.glsl"
uniform sampler2D u_factor;
uniform vec2 u_picture;
layout(location = 0) out float out_scaling;

void main() {
    mat2 slope;
    vec2 density = vec2(textureSize(u_factor, 0)) / u_picture;
    cubic_displacement(u_factor, gl_FragCoord.xy, 0.0, slope);
    float trace = slope[0].x * density.x + slope[1].y * density.y;
    float square = determinant(slope) * density.x * density.y;
    float whole = 1.0 + trace + square, least = min(whole, 1.0);
    // 1 + a trace + a^2 square is least inside only if it bends upwards there.
    if (square > 0.0 && -trace > 0.0 && -trace < 2.0 * square) least = 1.0 - trace * trace / (4.0 * square);
    out_scaling = whole > 0.0 ? -least / min(whole, 1.0) : -1.0;
}
