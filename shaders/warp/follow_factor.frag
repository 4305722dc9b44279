// Follow factor: E(x) = P(x) + a F(x + P(x)), a displacement led on by a part a of a factor F; x + E(x) stays in the picture.
// u_factor (F): over the whole picture, longer sides; u_moved (P): texel for texel, or 0 with FIRST; u_amount (a);
// u_picture: its width and height, longer sides; u_edges: see lib/warp.glsl; x: see lib/place.glsl.
// Define SUBMAP for the factor to be led by, at each of its texels, what has moved since: u_submap on the window u_window.
// reads: 37; 21 with SUBMAP, which reads F by the cubic
#include "lib/warp.glsl"
#include "lib/place.glsl"
uniform sampler2D u_factor;
uniform float u_amount;
#ifndef FIRST
uniform sampler2D u_moved;
in vec2 v_uv;
#endif
layout(location = 0) out vec2 out_displacement;

void main() {
    vec2 x = fragment_place() * u_picture, moved = vec2(0.0);
#ifdef SUBMAP
    moved = displacement_of_submaps(x);
#endif
#ifndef FIRST
    moved = within_picture(x, texture(u_moved, v_uv).rg);
#endif
    vec2 place = (x + moved) / u_picture * vec2(textureSize(u_factor, 0));
#ifdef SUBMAP
    vec2 led = cubic_displacement(u_factor, place, u_edges);
#else
    vec2 led = quintic_displacement(u_factor, place, u_edges);
#endif
    out_displacement = within_picture(x, moved + u_amount * led);
}
