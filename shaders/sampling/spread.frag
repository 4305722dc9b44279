// Spread: a displacement taken at the lattice of a picture in one direction, by a four-point Lagrange cubic; drawn once
// along x and then along y, which reads 8 texels where both at once would read 16.
// u_displacement: longer sides; u_first: lattice point of the first fragment, in pixels of the picture;
// u_scale: texels of the displacement to a pixel. Define ALONG_X for the first of the two, and PAIRED where a texel of
// the result holds two neighbours in x: so with half the reads along y.
// reads: 4
#include "lib/cubic.glsl"
uniform sampler2D u_displacement;
uniform float u_first;
uniform float u_scale;
#ifdef PAIRED
#define POINTS vec4
#else
#define POINTS vec2
#endif
layout(location = 0) out POINTS out_displacement;

#ifdef ALONG_X
#define TEXELS vec2
#define PARTS rg
#else
#define TEXELS POINTS
#ifdef PAIRED
#define PARTS rgba
#else
#define PARTS rg
#endif
#endif

// The displacement at a lattice point, in pixels from the first one, of `count` texels which lie at `first` + n `next`.
TEXELS taken(float point, float count, vec2 first, vec2 next) {
    float place = (point + u_first) * u_scale - 0.5;
    // Beyond the outermost texels the same polynomial goes on.
    float cell = clamp(floor(place), 1.0, count - 3.0);
    vec4 weights = cubic_lagrange(place - cell);
    TEXELS sum = TEXELS(0.0);
    for (int i = 0; i < 4; ++i)
        sum += weights[i] * texture(u_displacement, first + next * (cell + float(i) - 0.5)).PARTS;
    return sum;
}

void main() {
    vec2 size = vec2(textureSize(u_displacement, 0)), texel = 1.0 / size, point = gl_FragCoord.xy - 0.5;
#ifdef ALONG_X
    vec2 first = vec2(0.0, gl_FragCoord.y * texel.y), next = vec2(texel.x, 0.0);
#ifdef PAIRED
    out_displacement = vec4(taken(2.0 * point.x, size.x, first, next), taken(2.0 * point.x + 1.0, size.x, first, next));
#else
    out_displacement = taken(point.x, size.x, first, next);
#endif
#else
    out_displacement = taken(point.y, size.y, vec2(gl_FragCoord.x * texel.x, 0.0), vec2(0.0, texel.y));
#endif
}
