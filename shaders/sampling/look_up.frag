// Look up: the picture at x + D(x), the mean of places spread evenly over each pixel of the result.
// Along x and along y there are 2 clamp(ceil(0.75 s), 1, 4) of them, s the stretch of the map in that direction over the
// pixel; where the map only shifts, they come together at the centre. Four neighbours lie within a pixel of the picture,
// so they are looked up together, from the one block of pixels that holds all that each of them needs.
//
// u_source: the picture, or a piece of it, whose first pixel is u_corner and whose size u_extent, in pixels; premultiplied
// where PREPARED is defined, else as it is; u_raw: with PREPARED, the picture as it is;
// u_displacement: longer sides, at the corners of the result's pixels, or at their centres with SINGLE defined;
// u_pixel: the result's pixel of the first fragment; u_zoom: pixels of the picture to a pixel of the result;
// u_longer: pixels of the picture to a longer side; u_middle, u_half: middle and half sides, pixels, of the rectangle
// beyond which there is nothing, with an alpha of u_outside.
// Defines: TAPS 1, 2 or 4 (nearest, bilinear, Catmull-Rom) a direction; LEAST_PAIRS, MOST_PAIRS of places; SINGLE;
// PREPARED; WHOLE if u_source is all of the picture; ZOOMED unless u_zoom is 1; BOUNDED if there is an outside; OPAQUE if
// there is no alpha; LINEAR_LIGHT to encode; CODES if no value is infinite; CLAMPED to 0-1; DITHER to 8 bits; GREY_ALPHA.
// reads: 30
#ifndef TAPS
#define TAPS 4
#define LEAST_PAIRS 1
#define MOST_PAIRS 4
#endif
#include "lib/srgb.glsl"
uniform sampler2D u_source;
uniform sampler2D u_raw;
uniform sampler2D u_displacement;
uniform vec2 u_corner;
uniform vec2 u_extent;
uniform vec2 u_pixel;
uniform vec2 u_zoom;
uniform vec2 u_longer;
uniform vec2 u_middle;
uniform vec2 u_half;
uniform float u_outside;
layout(location = 0) out vec4 out_color;

// A component that is never read costs nothing.
#ifdef OPAQUE
#define COLOR vec3
#define PARTS rgb
#else
#define COLOR vec4
#define PARTS rgba
#endif

// The whole picture is clamped to its edges by the texture itself.
#ifdef WHOLE
#define CORNER 0.0
#define WITHIN(place, count) (place)
#else
#define CORNER u_corner
#define WITHIN(place, count) min(max(place, 0.5), (count) - 0.5)
#endif

#define AT(x, y) texture(u_source, vec2(x, y)).PARTS

// 1 within the bounds of the picture, 0 beyond them.
float within(vec2 place) {
#ifdef BOUNDED
    vec2 beyond = abs(place - u_middle) - u_half;
    return step(max(beyond.x, beyond.y), 0.0);
#else
    return 1.0;
#endif
}

#if TAPS > 1
const int BLOCK = TAPS + 1;

// Weights of the pixels 0, 1 ... TAPS for a place between the middle two of the first or of the last TAPS: f in [0, 2].
float[BLOCK] weights(float f) {
    float later = step(1.0, f), g = f - later, sooner = 1.0 - later;
#if TAPS == 2
    return float[BLOCK](sooner * (1.0 - g), mix(g, 1.0 - g, later), later * g);
#else
    // Catmull-Rom.
    float a = g * (-0.5 + g * (1.0 - 0.5 * g)), b = 1.0 + g * g * (-2.5 + 1.5 * g);
    float c = g * (0.5 + g * (2.0 - 1.5 * g)), d = g * g * (-0.5 + 0.5 * g);
    return float[BLOCK](sooner * a, mix(b, a, later), mix(c, b, later), mix(d, c, later), later * d);
#endif
}

// Texture coordinates of the first, second ... pixel of a block, in one direction.
float[BLOCK] coordinates(float first, float count, float texel) {
    float at[BLOCK];
    for (int i = 0; i < BLOCK; ++i)
        at[i] = WITHIN(first + float(i) + 0.5, count) * texel;
    return at;
}

// The mean of the picture at four places within a pixel of each other, given in pixels from the corner of the pixel
// `whole`: two parts, so that large pictures lose no precision. Beyond the bounds there is nothing.
COLOR four_places(vec2 whole, vec2 places[4]) {
    vec2 cell = floor(min(min(places[0], places[1]), min(places[2], places[3])) - float(TAPS / 2) + 0.5);
    vec2 first = whole - CORNER + cell, texel = 1.0 / vec2(textureSize(u_source, 0));
    float x[BLOCK] = coordinates(first.x, u_extent.x, texel.x), y[BLOCK] = coordinates(first.y, u_extent.y, texel.y);
    float along[4 * BLOCK], down[4 * BLOCK], there = 0.0;
    for (int k = 0; k < 4; ++k) {
        vec2 f = places[k] - cell - float(TAPS / 2) + 0.5;
        float wx[BLOCK] = weights(f.x), wy[BLOCK] = weights(f.y), part = 0.25 * within(whole + places[k]);
        there += part;
        for (int i = 0; i < BLOCK; ++i) {
            along[k * BLOCK + i] = part * wx[i];
            down[k * BLOCK + i] = wy[i];
        }
    }
    COLOR sum = COLOR(0.0);
    for (int j = 0; j < BLOCK; ++j)
        for (int i = 0; i < BLOCK; ++i) {
            float weight = 0.0;
            for (int k = 0; k < 4; ++k)
                weight += down[k * BLOCK + j] * along[k * BLOCK + i];
            sum += weight * AT(x[i], y[j]);
        }
#ifdef BOUNDED
    sum = there > 0.0 ? sum : COLOR(0.0);  // nothing times infinity is not nothing
#ifndef OPAQUE
    sum.a += (1.0 - there) * u_outside;
#endif
#endif
    return sum;
}
#endif

// The picture at one place.
COLOR one_place(vec2 whole, vec2 place) {
    vec2 texel = 1.0 / vec2(textureSize(u_source, 0));
#if TAPS == 1
    vec2 only = WITHIN(whole - CORNER + floor(place) + 0.5, u_extent) * texel;
    COLOR sum = AT(only.x, only.y);
#elif TAPS == 2
    vec2 cell = floor(place - 0.5), f = place - 0.5 - cell, first = whole - CORNER + cell;
    vec2 a = WITHIN(first + 0.5, u_extent) * texel, b = WITHIN(first + 1.5, u_extent) * texel;
    COLOR sum = mix(mix(AT(a.x, a.y), AT(b.x, a.y), f.x), mix(AT(a.x, b.y), AT(b.x, b.y), f.x), f.y);
#else
    vec2 cell = floor(place - 1.5), first = whole - CORNER + cell;
    float x[BLOCK] = coordinates(first.x, u_extent.x, texel.x), y[BLOCK] = coordinates(first.y, u_extent.y, texel.y);
    float wx[BLOCK] = weights(place.x - 1.5 - cell.x), wy[BLOCK] = weights(place.y - 1.5 - cell.y);
    COLOR sum = COLOR(0.0);
    for (int j = 0; j < TAPS; ++j)
        for (int i = 0; i < TAPS; ++i)
            sum += wy[j] * wx[i] * AT(x[i], y[j]);
#endif
#ifdef BOUNDED
    float there = within(whole + place);
#if defined(CODES)
    sum *= there;
#else
    sum = there > 0.0 ? sum : COLOR(0.0);
#endif
#ifndef OPAQUE
    sum.a += (1.0 - there) * u_outside;
#endif
#endif
    return sum;
}

// Deterministic noise in 0-1 that is even over every small neighbourhood (Jimenez 2014, interleaved gradient noise).
float even_noise(vec2 pixel) { return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))); }

vec2 displacement(int i, int j) {
    return texture(u_displacement, (gl_FragCoord.xy + vec2(i, j)) / vec2(textureSize(u_displacement, 0))).rg * u_longer;
}

void main() {
    vec2 pixel = floor(gl_FragCoord.xy) + u_pixel;
#ifdef ZOOMED
    vec2 zoom = u_zoom, whole = floor(pixel * zoom), rest = pixel * zoom - whole;
#else
    const vec2 zoom = vec2(1.0), rest = vec2(0.0);
    vec2 whole = pixel;
#endif
#ifdef SINGLE
    vec2 centre = rest + 0.5 * zoom + displacement(0, 0);
    COLOR color = one_place(whole, centre);
    bool shifted = true;
#else
    vec2 a = displacement(0, 0), b = displacement(1, 0), c = displacement(0, 1), d = displacement(1, 1);
    vec2 centre = rest + 0.5 * zoom + 0.25 * (a + b + c + d), bend = a - b - c + d;
    vec2 along_x = 0.5 * (b - a + d - c) + vec2(zoom.x, 0.0), along_y = 0.5 * (c - a + d - b) + vec2(0.0, zoom.y);
    // Where the map only shifts and turns, one place is enough, and keeps the picture as sharp as it is; between that and
    // a real distortion the places move apart, so that no seam shows.
    float strain = abs(length(along_x) - 1.0) + abs(length(along_y) - 1.0) + abs(dot(along_x, along_y));
    float apart = smoothstep(0.0, 0.2, strain);
    bool shifted = apart < 1e-3;
    vec2 stretch = vec2(length(along_x), length(along_y));
    vec2 pairs = shifted ? vec2(1.0) : clamp(ceil(0.75 * stretch), float(LEAST_PAIRS), float(MOST_PAIRS));
    // As far apart as gives the places the variance of the pixel itself: a mean of fourth order.
    vec2 spread = (shifted ? 0.0 : apart) * inversesqrt(1.0 - 0.25 / (pairs * pairs));
    // Half of the way from a place to its neighbours, and no farther than lets four of them share a block.
    vec2 near = 0.25 * spread / pairs, reach = near.x * abs(along_x) + near.y * abs(along_y) + near.x * near.y * abs(bend);
    near *= min(1.0, 0.499 / max(max(reach.x, reach.y), 1e-6));
    COLOR color = COLOR(0.0);
    vec2 place = vec2(0.5), places[4];
    for (int n = int(pairs.x * pairs.y); n > 0; --n) {
        vec2 off = spread * (place / pairs - 0.5);
        for (int k = 0; k < 4; ++k) {
            vec2 at = off + near * vec2(2 * (k & 1) - 1, (k & 2) - 1);
            places[k] = centre + at.x * along_x + at.y * along_y + (at.x * at.y) * bend;
        }
        color += four_places(whole, places);
        place = place.x + 1.0 < pairs.x ? place + vec2(1.0, 0.0) : vec2(0.5, place.y + 1.0);
    }
    color /= pairs.x * pairs.y;
#endif

#if defined(PREPARED) && !defined(OPAQUE)
    color.a = clamp(color.a, 0.0, 1.0);
    color.rgb = color.a > 0.0 ? color.rgb / color.a : vec3(0.0);
#endif
#ifdef CLAMPED
    color = clamp(color, 0.0, 1.0);
#endif
#ifdef LINEAR_LIGHT
    color.rgb = linear_to_srgb(color.rgb);
#endif
#ifdef DITHER
    color.rgb = floor(color.rgb * 255.0 + even_noise(pixel)) / 255.0;
#endif
#ifdef PREPARED
    // Moved by whole pixels, and above all not at all: the very values of the picture.
    vec2 nearest = floor(centre), same = whole - CORNER + nearest + 0.5;
    bool copied = shifted && all(lessThan(abs(centre - nearest - 0.5), vec2(1.0 / 1024.0)))
               && all(greaterThan(same, vec2(0.0))) && all(lessThan(same, u_extent));
    COLOR value = texture(u_raw, same / vec2(textureSize(u_raw, 0))).PARTS;
    color = copied ? value : color;
#endif
#ifdef GREY_ALPHA
    color.g = color.a;
#endif
    out_color.PARTS = color;
}
