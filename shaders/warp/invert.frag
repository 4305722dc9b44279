// Invert: F(y) = x - y with x + D(x) = y, by Newton's method from a guess.
// u_displacement (D), u_guess (F): longer sides, over the same domain; u_extent: its width and height, longer sides; u_size:
// the texels of D over all of it, u_corner: the first of them that is given; y: see lib/place.glsl.
// reads: 257
#include "lib/displacement.glsl"
#include "lib/place.glsl"
uniform sampler2D u_displacement;
uniform sampler2D u_guess;
uniform vec2 u_extent;
uniform vec2 u_size;
uniform vec2 u_corner;
layout(location = 0) out vec2 out_displacement;

const int ROUNDS = 16;
const float ROUNDING = 1e-7;  // longer sides, of a place in float32

void main() {
    float farthest = length(u_extent / vec2(textureSize(u_guess, 0))) * 0.70710678;  // that one round may go: as the guess is apart
    vec2 place = fragment_place(), density = u_size / u_extent;
    vec2 target = place * u_extent, found = texture(u_guess, place).rg, best = found;
    float least = 1e30;
    for (int round = 0; round < ROUNDS; ++round) {
        mat2 slope;
        // What is left over, without the rounding of the places themselves.
        vec2 rest = found + cubic_displacement(u_displacement, (target + found) * density - u_corner, vec4(0.0), slope);
        float error = dot(rest, rest);
        best = error < least ? found : best;
        least = min(error, least);
        if (error < ROUNDING * ROUNDING) {
            break;
        }
        mat2 jacobian = mat2(1.0) + mat2(slope[0] * density.x, slope[1] * density.y);
        float determinant = jacobian[0].x * jacobian[1].y - jacobian[1].x * jacobian[0].y;
        determinant = determinant < 0.0 ? min(determinant, -1e-4) : max(determinant, 1e-4);
        vec2 back = vec2(jacobian[1].y * rest.x - jacobian[1].x * rest.y,
                         jacobian[0].x * rest.y - jacobian[0].y * rest.x) / determinant;
        back *= min(1.0, farthest / max(length(back), 1e-20));
        found = clamp(target + found - back, vec2(0.0), u_extent) - target;
    }
    out_displacement = best;
}
