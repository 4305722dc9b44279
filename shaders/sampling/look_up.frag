// Look up: the picture at x + D(x), the mean of places spread evenly over each pixel of the result.
// Along x and along y there are clamp(ceil(1.5 s), 2, 8) of them, s the stretch of the map in that direction over the
// pixel, or one at the centre where the map only shifts.
//
// u_source: the picture, or a piece of it, whose first pixel is u_corner and whose size u_extent, in pixels; premultiplied
// where PREPARED is defined, else as it is; u_raw: with PREPARED, the picture as it is;
// u_displacement: longer sides, at the corners of the result's pixels, or at their centres with SINGLE defined;
// u_pixel: the result's pixel of the first fragment; u_zoom: pixels of the picture to a pixel of the result;
// u_longer: pixels of the picture to a longer side; u_inside: left, top, right, bottom bounds, pixels, beyond which
// there is u_outside.
// Defines: TAPS 1, 2 or 4 (nearest, bilinear, Catmull-Rom) a direction; LEAST_SAMPLES, MOST_SAMPLES; SINGLE; PREPARED;
// WHOLE if u_source is all of the picture; ZOOMED unless u_zoom is 1; BOUNDED if there is an outside; OPAQUE if there is
// no alpha; LINEAR_LIGHT to encode; CLAMPED to 0-1; DITHER to 8 bits; GREY_ALPHA.
// reads: 69
#ifndef TAPS
#define TAPS 4
#define LEAST_SAMPLES 2
#define MOST_SAMPLES 8
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
uniform vec4 u_inside;
uniform vec4 u_outside;
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

vec4 catmull_rom(float f) {
    return vec4(f * (-0.5 + f * (1.0 - 0.5 * f)), 1.0 + f * f * (-2.5 + 1.5 * f), f * (0.5 + f * (2.0 - 1.5 * f)),
                f * f * (-0.5 + 0.5 * f));
}

// The picture at `part` pixels from the corner of the pixel `whole`, two parts so that large pictures lose no precision.
COLOR picture(vec2 whole, vec2 part) {
    vec2 texel = 1.0 / vec2(textureSize(u_source, 0));
#define AT(x, y) texture(u_source, vec2(x, y)).PARTS
#if TAPS == 1
    vec2 only = WITHIN(whole - CORNER + floor(part) + 0.5, u_extent) * texel;
    COLOR sum = AT(only.x, only.y);
#else
    vec2 cell = floor(part - 0.5), f = part - 0.5 - cell, first = whole - CORNER + cell;
#if TAPS == 2
    vec2 a = WITHIN(first + 0.5, u_extent) * texel, b = WITHIN(first + 1.5, u_extent) * texel;
    COLOR sum = mix(mix(AT(a.x, a.y), AT(b.x, a.y), f.x), mix(AT(a.x, b.y), AT(b.x, b.y), f.x), f.y);
#else
    const vec4 OFFSETS = vec4(-0.5, 0.5, 1.5, 2.5);
    vec4 x = WITHIN(first.x + OFFSETS, u_extent.x) * texel.x, y = WITHIN(first.y + OFFSETS, u_extent.y) * texel.y;
    vec4 wx = catmull_rom(f.x), wy = catmull_rom(f.y);
    COLOR sum = COLOR(0.0);
    for (int j = 0; j < 4; ++j)
        sum += wy[j] * (wx.x * AT(x.x, y[j]) + wx.y * AT(x.y, y[j]) + wx.z * AT(x.z, y[j]) + wx.w * AT(x.w, y[j]));
#endif
#endif
#undef AT
#ifdef BOUNDED
    vec2 place = whole + part;
    bool inside = all(greaterThanEqual(vec4(place, u_inside.zw), vec4(u_inside.xy, place)));
    sum = inside ? sum : u_outside.PARTS;
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
    COLOR color = picture(whole, centre);
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
    vec2 samples = shifted ? vec2(1.0) : clamp(ceil(1.5 * stretch), float(LEAST_SAMPLES), float(MOST_SAMPLES));
    // As far apart as gives them the variance of the pixel itself: a mean of fourth order.
    vec2 spread = samples.x * samples.y > 1.0 ? apart * inversesqrt(1.0 - 1.0 / (samples * samples)) : vec2(0.0);
    COLOR color = COLOR(0.0);
    vec2 place = vec2(0.5);
    for (int n = int(samples.x * samples.y); n > 0; --n) {
        vec2 off = spread * (place / samples - 0.5);
        color += picture(whole, centre + off.x * along_x + off.y * along_y + (off.x * off.y) * bend);
        place = place.x + 1.0 < samples.x ? place + vec2(1.0, 0.0) : vec2(0.5, place.y + 1.0);
    }
    color /= samples.x * samples.y;
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
