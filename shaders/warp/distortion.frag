// Distortion: how the map x + D(x) stretches and folds, by the chain rule: J is the product of the Jacobians of its parts
// (lib/warp.glsl), each by the derivatives of the cubic both ways, so that nothing depends on how far apart the places are.
// With HELD, where the map is held, by those of what is kept of it. Define PART for a part u_amount of all displacements,
// x + u_amount D(x); above 1 for the part above 1 of the map after all of it, as in (S8) where there is one factor.
// x: see lib/place.glsl.
// largest: (-det J, det J, |D|), to be reduced to the largest of each;
// total: (1 where det J <= 0, |D|, |det J - 1|), to be reduced to their sums.
// reads: 24, and 8 more for each of LEVELS above 1, 16 of CLOSED, 4 for each of WEIGHED; twice that with PART
#include "lib/warp.glsl"
#include "lib/place.glsl"
#include "lib/jacobian.glsl"
#ifdef PART
uniform float u_amount;
#endif
layout(location = 0) out vec4 out_largest;
layout(location = 1) out vec4 out_total;

void main() {
    vec2 x = fragment_place() * u_picture;
    Bend bend = bend_at(x);
#ifdef PART
    float part = u_amount, before = 1.0;
    vec2 moved = vec2(0.0);
    if (u_amount > 1.0) {
        part -= 1.0;
        before = bend.determinant;
        moved = bend.moved;
        bend = bend_at(x + moved);
    }
    bend.determinant = before * determinant(mat2(1.0) + part * (bend.jacobian - mat2(1.0)));
    bend.moved = moved + part * bend.moved;
#endif
    float change = bend.determinant, far = length(bend.moved);
    out_largest = vec4(-change, change, far, 0.0);
    out_total = vec4(change <= 0.0 ? 1.0 : 0.0, far, abs(change - 1.0), 0.0);
}
