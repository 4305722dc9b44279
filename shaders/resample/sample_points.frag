// Sample points: a displacement interpolated at the lattice of a picture in one direction, by a four-point Lagrange
// cubic; drawn once along x and then along y, which reads 8 texels where both at once would read 16.
// u_displacement: longer sides; u_first: lattice point of the first fragment, in pixels of the picture;
// u_scale: texels of the displacement to a pixel. Define ALONG_X for the first of the two, and PAIRED where a texel of
// the result holds two neighbours in x: so with half the reads along y, and with NEAR, if u_scale is at most 1, along x.
// reads: 4
uniform sampler2D u_displacement;
uniform float u_first;
uniform float u_scale;
#if defined(PAIRED) && !defined(ALONG_X)
#define TEXELS vec4
#define PARTS rgba
#else
#define TEXELS vec2
#define PARTS rg
#endif
#include "lib/along.glsl"
#ifdef PAIRED
layout(location = 0) out vec4 out_displacement;
#else
layout(location = 0) out vec2 out_displacement;
#endif

// A lattice point, in pixels from the first one, as a place among the texels.
float place(float point) { return (point + u_first) * u_scale - 0.5; }

#ifdef NEAR
// At two places of which the second is less than a texel further: both look into the same five texels.
vec4 both(float a, float b, float count, vec2 first, vec2 next) {
    float cell = clamp(floor(a), 1.0, count - 3.0), later = clamp(floor(b), 1.0, count - 3.0) - cell;
    vec4 here = cubic_lagrange(a - cell), there = cubic_lagrange(b - cell - later), kept = (1.0 - later) * there;
    vec4 moved = later * there;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 5; ++i) {
        vec2 value = texture(u_displacement, first + next * (cell + float(i) - 0.5)).rg;
        float second = (i < 4 ? kept[i] : 0.0) + (i > 0 ? moved[i - 1] : 0.0);
        sum += vec4((i < 4 ? here[i] : 0.0) * value, second * value);
    }
    return sum;
}
#endif

void main() {
    vec2 size = vec2(textureSize(u_displacement, 0)), texel = 1.0 / size, point = gl_FragCoord.xy - 0.5;
#ifdef ALONG_X
    vec2 first = vec2(0.0, gl_FragCoord.y * texel.y), next = vec2(texel.x, 0.0);
#ifdef PAIRED
    float a = place(2.0 * point.x), b = place(2.0 * point.x + 1.0);
#ifdef NEAR
    out_displacement = both(a, b, size.x, first, next);
#else
    out_displacement = vec4(along(u_displacement, a, size.x, first, next), along(u_displacement, b, size.x, first, next));
#endif
#else
    out_displacement = along(u_displacement, place(point.x), size.x, first, next);
#endif
#else
    vec2 first = vec2(gl_FragCoord.x * texel.x, 0.0), next = vec2(0.0, texel.y);
    out_displacement = along(u_displacement, place(point.y), size.y, first, next);
#endif
}
