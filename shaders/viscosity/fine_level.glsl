// The next finer level while K is coarsened; FINE_IS_FINEST: no strain is coupled with another one there, and K above
// u_most counts as that.
#ifdef FINE_IS_FINEST
uniform float u_most;
#else
const float u_most = 3.4e38;
#endif

// A coarse cell lies over each texel of the finer level, and a coarse node at the upper left of it.
ivec2 fine_texel() { return 2 * ivec2(gl_FragCoord.xy) - 1; }

// K in four cells, or at their upper left nodes, which on the finest level has a sign; 0 beyond the ring.
vec4 fine(sampler2D k, ivec2 at) {
    return all(lessThan(at, textureSize(k, 0))) ? min(abs(texelFetch(k, at, 0)), u_most) : vec4(0.0);
}
