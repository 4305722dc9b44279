// The warp map as its parts: submaps on windows of the picture, the identity outside them, then the accumulated map.
//   D(x) = S(x) + A(x + S(x));   with LEVELS defined as 2 or 3, with the submaps that are still to be taken into A,
//   D(x) = S + S2 + S3 + A, each where those before it have led. x + S(x) is kept in the picture, and x + D(x) within
//   u_limits, which the texels of all are: between them a polynomial reaches beyond, and what is composed again and again
//   would grow without end.
// u_submap, u_second, u_third, u_accumulated: displacements, longer sides; u_window, u_second_window, u_third_window: left,
// top, width and height that the submaps cover, u_picture: width and height of the picture, u_limits: left, top, right,
// bottom, longer sides.
// Define HELD if something is frozen: where u_near is 1, A is taken as it is, and the nearer to it, the less do the
// submaps move, for along a wall the fluid may glide; over A's texels.
#include "lib/displacement.glsl"
uniform sampler2D u_submap;
uniform sampler2D u_accumulated;
uniform vec4 u_window;
uniform vec2 u_picture;
uniform vec4 u_limits;
#ifndef LEVELS
#define LEVELS 1
#endif
#if LEVELS > 1
uniform sampler2D u_second;
uniform vec4 u_second_window;
#endif
#if LEVELS > 2
uniform sampler2D u_third;
uniform vec4 u_third_window;
#endif
#ifdef HELD
uniform sampler2D u_near;
float freedom(vec2 x) { return 1.0 - texture(u_near, x / u_picture).r; }
#else
float freedom(vec2 x) { return 1.0; }
#endif

// Where nothing is beyond the limits, nothing is added, so that the identity stays one to the bit.
vec2 within(vec4 limits, vec2 x, vec2 moved) { return moved + (clamp(x + moved, limits.xy, limits.zw) - (x + moved)); }

vec2 within_picture(vec2 x, vec2 moved) { return within(vec4(0.0, 0.0, u_picture), x, moved); }

// 0-1 of a window, and 1 in it, 0 outside.
vec3 in_window(vec4 window, vec2 x) {
    vec2 across = (x - window.xy) / window.zw, inside = step(abs(across - 0.5), vec2(0.5));
    return vec3(across, inside.x * inside.y);
}

vec2 displacement_of(sampler2D submap, vec4 window, vec2 x) {
    vec3 at = in_window(window, x);
    return cubic_displacement(submap, at.xy * vec2(textureSize(submap, 0))) * at.z;
}

// Where the submaps lead from x.
vec2 displacement_of_submaps(vec2 x) {
    vec2 moved = within_picture(x, freedom(x) * displacement_of(u_submap, u_window, x));
#if LEVELS > 1
    moved = within_picture(x, moved + freedom(x + moved) * displacement_of(u_second, u_second_window, x + moved));
#endif
#if LEVELS > 2
    moved = within_picture(x, moved + freedom(x + moved) * displacement_of(u_third, u_third_window, x + moved));
#endif
    return moved;
}

// A at a held place, in its texels, to the bit: on a texel its very value, however the place was rounded, and between
// texels by the cubic both ways, which reaches none that moves.
vec2 held_displacement(vec2 place) {
    vec2 nearest = floor(place) + 0.5;
    mat2 slope;
    return cubic_displacement(u_accumulated, mix(place, nearest, lessThan(abs(place - nearest), vec2(1.0 / 512.0))), slope);
}
