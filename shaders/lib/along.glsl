// Between the texels of a line, by a four-point Lagrange cubic. Define TEXELS and PARTS: vec2 and rg, or vec4 and rgba.
// Beyond the outermost texels the same polynomial goes on. 4 reads.
#include "lib/cubic.glsl"

// At `place` of `count` texels, which lie at `first` + n `next`: 0 is the middle of the outermost one.
TEXELS along(sampler2D line, float place, float count, vec2 first, vec2 next) {
    float cell = clamp(floor(place), 1.0, count - 3.0);
    vec4 weights = cubic_lagrange(place - cell);
    TEXELS sum = TEXELS(0.0);
    for (int i = 0; i < 4; ++i)
        sum += weights[i] * texture(line, first + next * (cell + float(i) - 0.5)).PARTS;
    return sum;
}
