// Spread: a displacement taken at the lattice of a picture in one direction, by a four-point Lagrange cubic; drawn once
// along x and then along y, which reads 8 texels where both at once would read 16.
// u_displacement: longer sides; u_first: lattice point of the first fragment, in pixels of the picture;
// u_scale: texels of the displacement to a pixel. Define ALONG_X for the first of the two.
// reads: 4
#include "lib/cubic.glsl"
uniform sampler2D u_displacement;
uniform float u_first;
uniform float u_scale;
layout(location = 0) out vec2 out_displacement;

void main() {
    vec2 size = vec2(textureSize(u_displacement, 0)), texel = 1.0 / size;
#ifdef ALONG_X
    float along = gl_FragCoord.x, count = size.x;
    vec2 first = vec2(0.0, gl_FragCoord.y * texel.y), next = vec2(texel.x, 0.0);
#else
    float along = gl_FragCoord.y, count = size.y;
    vec2 first = vec2(gl_FragCoord.x * texel.x, 0.0), next = vec2(0.0, texel.y);
#endif
    float place = (along - 0.5 + u_first) * u_scale - 0.5;
    // Beyond the outermost texels the same polynomial goes on.
    float cell = clamp(floor(place), 1.0, count - 3.0);
    vec4 weights = cubic_lagrange(place - cell);
    vec2 sum = vec2(0.0);
    for (int i = 0; i < 4; ++i)
        sum += weights[i] * texture(u_displacement, first + next * (cell + float(i) - 0.5)).rg;
    out_displacement = sum;
}
