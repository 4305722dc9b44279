// Scale: a D + P - a Q, the part a of a displacement D whose factors, scaled by a, make P, and unscaled Q; all of them after
// another displacement, if there is one. Texel for texel. Without BENT there is one factor and no other, and P = a Q; with
// it x + the part stays in the picture, which D and Q, where they differ, would lead it out of.
// u_displacement (D), u_scaled (P), u_unscaled (Q): longer sides; u_amount: a; u_picture: its width and height, longer sides;
// x: see lib/place.glsl.
// reads: 3
#ifdef BENT
#include "lib/warp.glsl"
#include "lib/place.glsl"
#endif
uniform sampler2D u_displacement;
uniform float u_amount;
#ifdef BENT
uniform sampler2D u_scaled;
uniform sampler2D u_unscaled;
#endif
in vec2 v_uv;
layout(location = 0) out vec2 out_displacement;

void main() {
    out_displacement = u_amount * texture(u_displacement, v_uv).rg;
#ifdef BENT
    vec2 scaled = texture(u_scaled, v_uv).rg, unscaled = texture(u_unscaled, v_uv).rg;
    out_displacement += scaled - u_amount * unscaled;
    out_displacement = within_picture(fragment_place() * u_picture, out_displacement);
#endif
}
