// The place a fragment stands for, in 0-1 of the domain: on a lattice, place = (fragment + u_origin) u_step, or, with
// POINTS defined, out of a list.
#ifdef POINTS
uniform sampler2D u_points;
vec2 fragment_place() { return texelFetch(u_points, ivec2(gl_FragCoord.xy), 0).rg; }
#else
uniform vec2 u_origin;
uniform vec2 u_step;
vec2 fragment_place() { return (gl_FragCoord.xy + u_origin) * u_step; }
#endif
