// The place a fragment stands for, in 0-1 of the domain: on a lattice, place = (fragment + u_origin) u_step; with LATTICES
// defined on one of several with so many rows each, one below the other; or, with POINTS defined, out of a list.
#ifdef POINTS
uniform sampler2D u_points;
vec2 fragment_place() { return texelFetch(u_points, ivec2(gl_FragCoord.xy), 0).rg; }
// What is told of the point besides: the lower half of the list.
vec4 fragment_more() { return texelFetch(u_points, ivec2(gl_FragCoord.xy) + ivec2(0, textureSize(u_points, 0).y / 2), 0); }
#elif defined(LATTICES)
#include "lib/images.glsl"
uniform vec2 u_origins[MOST_IMAGES];
uniform vec2 u_step;
vec2 fragment_place() {
    int lattice = int(gl_FragCoord.y) / LATTICES;
    return (gl_FragCoord.xy - vec2(0.0, lattice * LATTICES) + u_origins[lattice]) * u_step;
}
#else
uniform vec2 u_origin;
uniform vec2 u_step;
vec2 fragment_place() { return (gl_FragCoord.xy + u_origin) * u_step; }
#endif
