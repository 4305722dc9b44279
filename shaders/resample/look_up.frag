// Look up: the picture at x + D(x), the mean of samples spread evenly over each pixel of the result.
// Along x and along y there are 2 clamp(ceil(0.75 s), 1, 4) of them, s the stretch of the map in that direction over
// the pixel; where the map shrinks and distorts nothing, there is one at the centre. Four neighbours lie within a pixel of the
// picture: they are looked up at once, in the block of pixels that holds what they are made of.
// Blocks of one class are drawn at a time (classify.frag), as a software rasteriser goes through every branch.
//
// u_source: the picture, or a piece of it, whose first pixel is u_corner and whose size u_extent, in pixels;
// premultiplied where PREPARED is defined, two neighbours in a texel where PACKED is (prepare.frag), else as it is;
// u_raw: the picture as it is;
// u_displacement: longer sides, at the corners of the result's pixels; with ONE defined at their centres along x, as
// sample_points.frag draws it, and along y still at the map's texels, u_scale to a pixel, or with AT_CENTRES both ways;
// u_texel, u_raw_texel, u_next: size of a texel of both and of the displacement, 0-1;
// u_pixel: the result's pixel of the first fragment, or the first of its two; u_zoom: pixels of the picture to a pixel of
// the result; u_longer: pixels of the picture to a longer side; u_middle, u_half: middle and half sides, pixels, of the rectangle
// beyond which there is nothing, with an alpha of u_outside.
// Defines: TAPS 1, 2 or 4 (nearest, bilinear, Catmull-Rom) a direction; LEAST_PAIRS, MOST_PAIRS of samples, or ONE;
// PREPARED; WHOLE if u_source is all of the picture; ZOOMED unless u_zoom is 1; BOUNDED if there is an outside; OPAQUE if
// there is no alpha; PREMULTIPLIED if u_raw is, and the result; LINEAR_LIGHT to encode; CODES if no value is infinite;
// LIMITED where what Catmull-Rom makes is kept within the range of the pixels that the places lie between; CLAMPED to 0-1; DITHER to 8 bits; GREY_ALPHA; PAIRED where a fragment is two neighbours in x, four bytes each, and a texel of u_displacement too: what
// they have in common is done once, and a software rasteriser waits for the pixels of both at the same time.
// reads: 30
#ifndef TAPS
#define TAPS 4
#define LEAST_PAIRS 1
#define MOST_PAIRS 4
#endif
#include "lib/srgb.glsl"
#include "lib/footprint.glsl"
#ifdef PACKED
uniform usampler2D u_source;
#else
uniform sampler2D u_source;
#endif
uniform sampler2D u_raw;
uniform sampler2D u_displacement;
uniform vec2 u_texel;
uniform vec2 u_raw_texel;
uniform vec2 u_next;
uniform vec2 u_corner;
uniform vec2 u_extent;
uniform vec2 u_pixel;
uniform vec2 u_zoom;
uniform vec2 u_longer;
uniform vec2 u_middle;
uniform vec2 u_half;
uniform float u_outside;
#ifdef PAIRED
layout(location = 0) out uvec2 out_colors;
#else
layout(location = 0) out vec4 out_color;
#endif

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

// What is added up over pixels: of two neighbours at a time, where a texel of the source holds both.
#ifdef PACKED
const float UNIT = 1.0 / 65535.0, LEFT = 1.0;
const int STRIDE = 2;
#define EXTENT (u_extent + vec2(1.0, 0.0))
COLOR weighed(float x, float y, float weight, float next) {
    uvec4 both = texture(u_source, vec2(x, y));
    return weight * vec4(ivec4(both & 0xffffu)).PARTS + next * vec4(ivec4(both >> 16u)).PARTS;
}
#else
const float UNIT = 1.0, LEFT = 0.0;
const int STRIDE = 1;
#define EXTENT u_extent
COLOR weighed(float x, float y, float weight, float next) { return weight * AT(x, y); }
#endif

// For two places, and for x and y of each: 1 within the bounds of the picture, 0 beyond them.
vec4 within(vec2 a, vec2 b) {
#ifdef BOUNDED
    return step(abs(vec4(a, b) - u_middle.xyxy), u_half.xyxy);
#else
    return vec4(1.0);
#endif
}

#if TAPS > 1
const int BLOCK = TAPS + 1;

// Weights of the pixels that a place is interpolated from, in one direction: f in [0, 1] between the middle two.
float[TAPS] weights(float f) {
#if TAPS == 2
    return float[TAPS](1.0 - f, f);
#else
    // Catmull-Rom.
    return float[TAPS](f * (-0.5 + f * (1.0 - 0.5 * f)), 1.0 + f * f * (-2.5 + 1.5 * f),
                       f * (0.5 + f * (2.0 - 1.5 * f)), f * f * (-0.5 + 0.5 * f));
#endif
}

// Texture coordinates of the first, second ... pixel of a block, in one direction.
float[BLOCK] coordinates(float first, float count, float texel) {
    float at[BLOCK];
    for (int i = 0; i < BLOCK; ++i)
        at[i] = WITHIN(first + float(i) + 0.5, count) * texel;
    return at;
}

// Weights of the pixels of a block for two places in one direction, at `low` in [0, 1] and `high` in [0, 2] between its
// middle ones: half their sum, and half their difference. `there` is 0 for a place beyond the bounds.
void both(float low, float high, vec2 there, out float mean[BLOCK], out float odd[BLOCK]) {
    float later = step(1.0, high), a[TAPS] = weights(low), b[TAPS] = weights(high - later);
    for (int i = 0; i < BLOCK; ++i) {
        float first = i < TAPS ? 0.5 * there.x * a[i] : 0.0;
        float second = (i < TAPS ? (1.0 - later) * b[i] : 0.0) + (i > 0 ? later * b[i - 1] : 0.0);
        mean[i] = first + 0.5 * there.y * second;
        odd[i] = 0.5 * there.y * second - first;
    }
}

#ifdef LIMITED
// A sum whose weights add up to `part`, within the range of a block's pixels from its second to `last`, both ways.
COLOR limited(COLOR sum, float part, float x[BLOCK], float y[BLOCK], ivec2 last) {
    COLOR least = AT(x[1], y[1]), most = least;
    for (int j = 1; j <= last.y; ++j)
        for (int i = 1; i <= last.x; ++i) {
            COLOR value = AT(x[i], y[j]);
            least = min(least, value);
            most = max(most, value);
        }
    return clamp(sum, part * least, part * most);
}
#endif

// The mean of the picture over four sample points: `middle` with `offset` added or taken away along x and along y, in pixels
// from the corner of the pixel `whole` (two parts, so that large pictures lose no precision). The two on one diagonal
// weigh (1 + correlation) / 4 each, the others (1 - correlation) / 4, so that any parallelogram's second moments are
// met. Beyond the bounds there is nothing. `offset` is less than half a pixel, and so all are made of one block.
COLOR four_samples(vec2 whole, vec2 middle, vec2 offset, float correlation) {
    vec2 cell = floor(middle - offset - float(TAPS / 2) + 0.5), first = whole - CORNER + cell;
    vec2 low = middle - offset - cell - float(TAPS / 2) + 0.5, high = low + 2.0 * offset;
    vec4 there = within(whole + middle - offset, whole + middle + offset);
    float x[BLOCK] = coordinates(first.x + LEFT, EXTENT.x, u_texel.x), y[BLOCK] = coordinates(first.y, EXTENT.y, u_texel.y);
    float mean_x[BLOCK], odd_x[BLOCK], mean_y[BLOCK], odd_y[BLOCK];
    both(low.x, high.x, there.xz, mean_x, odd_x);
    both(low.y, high.y, there.yw, mean_y, odd_y);
    COLOR sum = COLOR(0.0);
    for (int j = 0; j < BLOCK; ++j) {
        float odd = correlation * odd_y[j];
        for (int i = 0; i < BLOCK; i += STRIDE) {
            float next = i + 1 < BLOCK ? mean_y[j] * mean_x[i + 1] + odd * odd_x[i + 1] : 0.0;
            sum += weighed(x[i], y[j], mean_y[j] * mean_x[i] + odd * odd_x[i], next);
        }
    }
    sum *= UNIT;
#ifdef BOUNDED
    vec2 some = there.xy + there.zw, odds = there.zw - there.xy;
    float part = 0.25 * (some.x * some.y + correlation * odds.x * odds.y);
#else
    const float part = 1.0;
#endif
#ifdef LIMITED
    sum = limited(sum, part, x, y, ivec2(2) + ivec2(step(1.0, high)));
#endif
#ifdef BOUNDED
    sum = part > 0.0 ? sum : COLOR(0.0);  // nothing times infinity is not nothing
#ifndef OPAQUE
    sum.a += (1.0 - part) * u_outside;
#endif
#endif
    return sum;
}
#endif

// The picture at one place.
COLOR one_sample(vec2 whole, vec2 place) {
#if TAPS == 1
    vec2 only = WITHIN(whole - CORNER + floor(place) + 0.5, u_extent) * u_texel;
    COLOR sum = AT(only.x, only.y);
#elif TAPS == 2
    vec2 cell = floor(place - 0.5), f = place - 0.5 - cell, first = whole - CORNER + cell;
    vec2 a = WITHIN(first + vec2(LEFT, 0.0) + 0.5, EXTENT) * u_texel, b = WITHIN(first + 1.5, EXTENT) * u_texel;
#ifdef PACKED
    COLOR sum = UNIT * mix(weighed(a.x, a.y, 1.0 - f.x, f.x), weighed(a.x, b.y, 1.0 - f.x, f.x), f.y);
#else
    COLOR sum = mix(mix(AT(a.x, a.y), AT(b.x, a.y), f.x), mix(AT(a.x, b.y), AT(b.x, b.y), f.x), f.y);
#endif
#else
    vec2 cell = floor(place - 1.5), first = whole - CORNER + cell;
    float x[BLOCK] = coordinates(first.x + LEFT, EXTENT.x, u_texel.x), y[BLOCK] = coordinates(first.y, EXTENT.y, u_texel.y);
    float wx[TAPS] = weights(place.x - 1.5 - cell.x), wy[TAPS] = weights(place.y - 1.5 - cell.y);
    COLOR sum = COLOR(0.0);
    for (int j = 0; j < TAPS; ++j)
        for (int i = 0; i < TAPS; i += STRIDE)
            sum += weighed(x[i], y[j], wy[j] * wx[i], wy[j] * wx[min(i + 1, TAPS - 1)]);
    sum *= UNIT;
#ifdef LIMITED
    sum = limited(sum, 1.0, x, y, ivec2(2));
#endif
#endif
#ifdef BOUNDED
    vec2 beyond = abs(whole + place - u_middle) - u_half;
    float there = step(max(beyond.x, beyond.y), 0.0);
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

// The displacement at the corners of a pixel of the result: upper left and right, lower left and right; at its centre
// where there is one place. In the picture's pixels.
#ifdef ONE
#define CORNERS vec2
#else
#define CORNERS mat4x2
#endif

// The result's pixel.
vec4 look_up(vec2 pixel, CORNERS at) {
#ifdef ZOOMED
    vec2 zoom = u_zoom, whole = floor(pixel * zoom), rest = pixel * zoom - whole;
#else
    const vec2 zoom = vec2(1.0), rest = vec2(0.0);
    vec2 whole = pixel;
#endif
#ifdef ONE
    const bool shifted = true;
    vec2 centre = rest + 0.5 * zoom + at;
    COLOR color = one_sample(whole, centre);
#else
    vec2 a = at[0], b = at[1], c = at[2], d = at[3];
    vec2 centre = rest + 0.5 * zoom + 0.25 * (a + b + c + d);
    vec2 along_x = 0.5 * (b - a + d - c) + vec2(zoom.x, 0.0), along_y = 0.5 * (c - a + d - b) + vec2(0.0, zoom.y);
    float away_from_one = footprint(along_x, along_y);
    bool shifted = away_from_one < 1e-3;
#if MOST_PAIRS > 1
    vec2 bend = a - b - c + d, stretch = vec2(length(along_x), length(along_y));
    vec2 pairs = clamp(ceil(0.75 * stretch), float(LEAST_PAIRS), float(MOST_PAIRS));
#else
    const vec2 pairs = vec2(1.0);
#endif
    // As far from each other as gives the samples the variance of the pixel itself: a mean of fourth order.
    vec2 stride = away_from_one * inversesqrt(1.0 - 0.25 / (pairs * pairs));
    // The second moments of the four samples about the middle of each four.
    vec2 u = 0.25 * stride.x / pairs.x * along_x, v = 0.25 * stride.y / pairs.y * along_y;
    vec2 moments = u * u + v * v;
    float correlation = (u.x * u.y + v.x * v.y) * inversesqrt(max(moments.x * moments.y, 1e-20));
    vec2 away = min(sqrt(moments), 0.499);
#if MOST_PAIRS > 1
    COLOR color = COLOR(0.0);
    vec2 place = vec2(0.5);
    for (int n = int(pairs.x * pairs.y); n > 0; --n) {
        vec2 off = stride * (place / pairs - 0.5);
        vec2 middle = centre + off.x * along_x + off.y * along_y + (off.x * off.y) * bend;
        color += four_samples(whole, middle, away, correlation);
        place = place.x + 1.0 < pairs.x ? place + vec2(1.0, 0.0) : vec2(0.5, place.y + 1.0);
    }
    color /= pairs.x * pairs.y;
#else
    COLOR color = four_samples(whole, centre, away, correlation);
#endif
#endif

#if TAPS > 1 && !defined(OPAQUE)
    // The weights add up to 1 but for their rounding, less than a millionth: what is opaque stays so, in the very colours
    // that it has without an alpha channel.
    color.a = color.a > 1.0 - 1e-5 ? 1.0 : max(color.a, 0.0);
#ifdef PREPARED
    float weight = color.a > 0.0 ? color.a : 1.0;
#ifdef PREMULTIPLIED
    color.rgb /= weight;
#else
    color.rgb = color.a > 0.0 ? color.rgb / weight : vec3(0.0);
#endif
#endif
#endif
#ifdef CLAMPED
    color = clamp(color, 0.0, 1.0);
#endif
#ifdef LINEAR_LIGHT
    color.rgb = linear_to_srgb(color.rgb);
#endif
#if defined(PREPARED) && defined(PREMULTIPLIED)
    color.rgb *= weight;
#endif
#ifdef DITHER
    color.rgb = min(floor(color.rgb * 255.0 + even_noise(pixel)), 255.0) / 255.0;
#endif
#if TAPS > 1 && !defined(ZOOMED) && (defined(PREPARED) || !defined(CODES))
    // Moved by whole pixels, and above all not at all: the very values of the picture, infinite ones and NaN too.
    vec2 nearest = floor(centre), same = whole - CORNER + nearest + 0.5;
    bool copied = shifted && all(lessThan(abs(centre - nearest - 0.5), vec2(1.0 / 1024.0)))
               && all(greaterThan(same, vec2(0.0))) && all(lessThan(same, u_extent));
    COLOR value = texture(u_raw, same * u_raw_texel).PARTS;
    color = copied ? value : color;
#endif
#ifdef GREY_ALPHA
    color.g = color.a;
#endif
#ifdef OPAQUE
    return vec4(color, 1.0);
#else
    return color;
#endif
}

// Displacements: of two neighbours in a texel, or of one.
#undef PARTS
#ifdef PAIRED
#define TEXELS vec4
#define PARTS rgba
#define LONGER u_longer.xyxy
#else
#define TEXELS vec2
#define PARTS rg
#define LONGER u_longer
#endif

#ifdef AT_CENTRES
TEXELS at_centre(float pixel) { return texture(u_displacement, gl_FragCoord.xy * u_next).PARTS * LONGER; }
#elif defined(ONE)
#include "lib/along.glsl"
uniform float u_scale;

TEXELS at_centre(float pixel) {
    float place = (pixel + 0.5) * u_scale - 0.5;
    vec2 first = vec2(gl_FragCoord.x * u_next.x, 0.0);
    return along(u_displacement, place, float(textureSize(u_displacement, 0).y), first, vec2(0.0, u_next.y)) * LONGER;
}
#else
TEXELS displacement(float i, float j) {
    return texture(u_displacement, (gl_FragCoord.xy + vec2(i, j)) * u_next).PARTS * LONGER;
}
#endif

#ifdef PAIRED
// Four values of 0-1 as bytes.
uint in_a_word(vec4 color) {
    ivec4 codes = ivec4(color * 255.0 + 0.5);
    return uint(codes.r | codes.g << 8 | codes.b << 16 | codes.a << 24);
}

void main() {
    vec2 left = floor(gl_FragCoord.xy) * vec2(2.0, 1.0) + u_pixel, right = left + vec2(1.0, 0.0);
#ifdef ONE
    vec4 at = at_centre(left.y);
    vec4 first = look_up(left, at.xy), second = look_up(right, at.zw);
#else
    vec4 upper = displacement(0.0, 0.0), lower = displacement(0.0, 1.0);
    vec2 upper_right = displacement(1.0, 0.0).xy, lower_right = displacement(1.0, 1.0).xy;
    vec4 first = look_up(left, CORNERS(upper, lower));
    vec4 second = look_up(right, CORNERS(upper.zw, upper_right, lower.zw, lower_right));
#endif
    out_colors = uvec2(in_a_word(first), in_a_word(second));
}
#else
void main() {
    vec2 pixel = floor(gl_FragCoord.xy) + u_pixel;
#ifdef ONE
    out_color = look_up(pixel, at_centre(pixel.y));
#else
    out_color = look_up(pixel, CORNERS(displacement(0.0, 0.0), displacement(1.0, 0.0),
                                       displacement(0.0, 1.0), displacement(1.0, 1.0)));
#endif
}
#endif
