// Classify: what the blocks of a result want when they are looked up, from the map's texels about each block: 2 kind +
// inside, over 255. Kind 0: one sample a pixel is enough; 1: four samples are, as 0.75 of the stretch is at
// most 1; 2: more are wanted. Inside: 1 where every sample lies within the bounds of the picture.
// u_displacement: longer sides, of texels of u_texel, 0-1; u_side: pixels of the result along a block; u_scale: texels to
// a pixel of the result; u_zoom: pixels of the picture to one of the result; u_longer: pixels of the picture to a longer side;
// u_middle, u_half: middle and half sides, pixels, of the rectangle beyond which there is nothing.
// Define SINGLE where one sample is enough anyway, EVERYWHERE where four or more are wanted as soon as one is not enough.
// Define HELD if something is held (u_held, over the map's texels): blocks with some of that keep their kind whatever moves
// around it, as no two kinds round alike: 2, but 0 where nothing moves and u_zoom is 1, which all kinds copy.
// reads: 300, and 100 more with HELD
#include "lib/footprint.glsl"
uniform sampler2D u_displacement;
uniform vec2 u_texel;
uniform float u_side;
uniform vec2 u_scale;
uniform vec2 u_zoom;
uniform vec2 u_longer;
uniform vec2 u_middle;
uniform vec2 u_half;
#ifdef HELD
uniform sampler2D u_held;
#endif
layout(location = 0) out float out_class;

const float ONE_SAMPLE = 0.05;  // as near each other as that they make less than a quarter of a level of 255
const float FOUR_SAMPLES = 1.33;

vec2 displacement(vec2 texel) { return texture(u_displacement, (texel + 0.5) * u_texel).rg * u_longer; }

void main() {
    vec2 count = 1.0 / u_texel;
    vec2 corner = floor(gl_FragCoord.xy) * u_side, step_x = vec2(u_zoom.x, 0.0), step_y = vec2(0.0, u_zoom.y);
    // A cubic reaches two texels beyond its place.
    vec2 first = clamp(floor(corner * u_scale - 1.5), vec2(0.0), count - 2.0);
    vec2 last = clamp(floor((corner + u_side) * u_scale + 1.5), first + 1.0, count - 1.0);
    vec2 low = vec2(1e30), high = vec2(-1e30), change = vec2(0.0);
    float farthest = 0.0, longest = 0.0, held = 0.0;
    for (float j = first.y; j < last.y - 0.5; ++j) {
        vec2 here = displacement(vec2(first.x, j));
        for (float i = first.x; i < last.x - 0.5; ++i) {
            vec2 right = displacement(vec2(i + 1.0, j)), below = displacement(vec2(i, j + 1.0));
            low = min(low, min(here, min(right, below)));
            high = max(high, max(here, max(right, below)));
            change = max(change, max(abs(right - here), abs(below - here)));
#ifndef SINGLE
            vec2 a = (right - here) * u_scale.x + step_x, b = (below - here) * u_scale.y + step_y;
            farthest = max(farthest, footprint(a, b));
            longest = max(longest, max(length(a), length(b)));
#endif
#ifdef HELD
            held = max(held, texture(u_held, (vec2(i, j) + 0.5) * u_texel).r);
#endif
            here = right;
        }
    }
#ifdef EVERYWHERE
    const float most = float(EVERYWHERE), four = most;
#else
    const float most = 2.0, four = 1.0;
#endif
    float kind = farthest > ONE_SAMPLE ? (longest > FOUR_SAMPLES ? most : four) : 0.0;
#if defined(HELD) && !defined(SINGLE)
    bool copies = u_zoom == vec2(1.0) && low == vec2(0.0) && high == vec2(0.0);
    kind = held >= 0.5 && !copies ? most : kind;
#endif
    // Between texels, and beyond the outermost ones, the map is never farther than that from those around.
    vec2 margin = 4.0 * change + 1.0;
    vec2 from = corner * u_zoom + low - margin, to = (corner + u_side) * u_zoom + high + margin;
    bool inside = all(greaterThan(from, u_middle - u_half)) && all(lessThan(to, u_middle + u_half));
    out_class = (2.0 * kind + (inside ? 1.0 : 0.0)) / 255.0;
}
