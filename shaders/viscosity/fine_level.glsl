// The next finer level while K is coarsened; FINE_IS_FINEST: no strain is coupled with another one there.

// A coarse cell lies over each texel of the finer level, and a coarse node at the upper left of it.
ivec2 fine_texel() { return 2 * ivec2(gl_FragCoord.xy) - 1; }

// K in four cells, or at their upper left nodes, which on the finest level has a sign; 0 beyond the ring.
vec4 fine(sampler2D k, ivec2 at) {
    return all(lessThan(at, textureSize(k, 0))) ? abs(texelFetch(k, at, 0)) : vec4(0.0);
}
