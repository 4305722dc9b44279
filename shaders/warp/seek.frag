// Seek: where points of the original are, x with x + D(x) = y, by Newton's method from guesses out of a list: how far x is
// from the guess, and x + D(x) from y (longer sides).
// The guess, and what is told of it: see lib/place.glsl; the latter is guess - y, then how far a round may go, longer sides.
// reads: 544, and 128 more for each of LEVELS above 1, 416 for each of CLOSED, 64 for each of WEIGHED; of eight rounds, of
// which two or three are usual
#define POINTS 1
#include "lib/warp.glsl"
#include "lib/place.glsl"
#include "lib/jacobian.glsl"
layout(location = 0) out vec4 out_found;

const int ROUNDS = 8;
const float FOUND = 1e-7;  // longer sides, as places are rounded

void main() {
    vec3 more = fragment_more().rgb;
    vec2 guess = fragment_place() * u_picture, gone = vec2(0.0);
    out_found = vec4(0.0, 0.0, 1e30, 0.0);
    for (int round = 0; round < ROUNDS && out_found.z >= FOUND; ++round) {
        // Without the rounding of the places themselves.
        vec2 rest = more.xy + gone + displacement_at(guess + gone);
        float far = length(rest);
        if (far < out_found.z) out_found = vec4(gone, far, 0.0);
        mat2 jacobian = bend_at(guess + gone).jacobian;
        float change = determinant(jacobian);
        vec2 back = vec2(jacobian[1].y * rest.x - jacobian[1].x * rest.y, jacobian[0].x * rest.y - jacobian[0].y * rest.x);
        back /= change < 0.0 ? min(change, -1e-4) : max(change, 1e-4);
        back *= min(1.0, more.z / max(length(back), 1e-30));
        gone = clamp(guess + gone - back, vec2(0.0), u_picture) - guess;
    }
}
