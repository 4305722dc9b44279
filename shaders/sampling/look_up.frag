// Look up: the picture at x + D(x), the mean of k x k places within each pixel of the result.
// k follows the largest stretch sigma of the map over the pixel: clamp(ceil(2 sigma), 2, 8), or 1 at its centre.
//
// u_source: the picture, or a piece of it, whose first pixel is u_corner and whose size u_extent, in pixels; premultiplied
// where PREPARED is defined, else as it is; u_raw: with PREPARED, the picture as it is;
// u_displacement: longer sides, at the corners of the result's pixels, or at their centres with SINGLE defined;
// u_pixel: the result's pixel of the first fragment; u_zoom: pixels of the picture to a pixel of the result;
// u_longer: pixels of the picture to a longer side; u_inside: left, top, right, bottom bounds, pixels, beyond which
// there is u_outside.
// Defines: TAPS 1, 2 or 4 (nearest, bilinear, Catmull-Rom) a direction; LEAST_SAMPLES, MOST_SAMPLES for k; SINGLE; PREPARED;
// LINEAR_LIGHT to encode; LEVELS: code values to round to, with DITHER or to the nearest; GREY_ALPHA; CLAMPED: 0-1.
// reads: 65
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

#if TAPS == 4
#define WEIGHTS vec4
vec4 tap_weights(float f) {
    return vec4(f * (-0.5 + f * (1.0 - 0.5 * f)), 1.0 + f * f * (-2.5 + 1.5 * f), f * (0.5 + f * (2.0 - 1.5 * f)),
                f * f * (-0.5 + 0.5 * f));
}
#elif TAPS == 2
#define WEIGHTS vec2
vec2 tap_weights(float f) { return vec2(1.0 - f, f); }
#endif

// The picture at `part` pixels from the corner of the pixel `whole`, two parts so that large pictures lose no precision.
vec4 picture(vec2 whole, vec2 part) {
    vec2 place = whole + part;
    if (any(lessThan(place, u_inside.xy)) || any(greaterThan(place, u_inside.zw)))
        return u_outside;
    vec2 texel = 1.0 / vec2(textureSize(u_source, 0)), last = u_extent - 0.5;
#if TAPS == 1
    return texture(u_source, clamp(whole - u_corner + floor(part) + 0.5, vec2(0.5), last) * texel);
#else
    vec2 cell = floor(part - 0.5), f = part - 0.5 - cell;
    vec2 first = whole - u_corner + cell + 1.5 - float(TAPS / 2);
    WEIGHTS wx = tap_weights(f.x), wy = tap_weights(f.y);
    vec4 sum = vec4(0.0);
    for (int j = 0; j < TAPS; ++j)
        for (int i = 0; i < TAPS; ++i)
            sum += wx[i] * wy[j] * texture(u_source, clamp(first + vec2(i, j), vec2(0.5), last) * texel);
    return sum;
#endif
}

// Deterministic noise in 0-1 that is even over every small neighbourhood (Jimenez 2014, interleaved gradient noise).
float even_noise(vec2 pixel) { return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))); }

vec2 displacement(int i, int j) {
    return texelFetch(u_displacement, ivec2(gl_FragCoord.xy) + ivec2(i, j), 0).rg * u_longer;
}

void main() {
    vec2 pixel = floor(gl_FragCoord.xy) + u_pixel, whole = floor(pixel * u_zoom), rest = pixel * u_zoom - whole;
    vec4 color;
    vec2 centre;
    bool copied;
#ifdef SINGLE
    centre = rest + 0.5 * u_zoom + displacement(0, 0);
    color = picture(whole, centre);
    copied = true;
#else
    vec2 a = displacement(0, 0), b = displacement(1, 0), c = displacement(0, 1), d = displacement(1, 1);
    vec2 dx = 0.5 * (b - a + d - c), dy = 0.5 * (c - a + d - b), bend = a - b - c + d;
    centre = rest + 0.5 * u_zoom + 0.25 * (a + b + c + d);
    vec2 jx = dx + vec2(u_zoom.x, 0.0), jy = dy + vec2(0.0, u_zoom.y);
    float sum = dot(jx, jx) + dot(jy, jy), stretch = dot(jx, jx) - dot(jy, jy), shear = 2.0 * dot(jx, jy);
    float sigma = sqrt(0.5 * (sum + sqrt(stretch * stretch + shear * shear)));
    // Where the map only shifts, one place is enough, and keeps the picture as sharp as it is; between that and a real
    // distortion the places move apart, so that no seam shows.
    float apart = smoothstep(0.0, 0.05, length(jx - vec2(1.0, 0.0)) + length(jy - vec2(0.0, 1.0)));
    copied = apart < 1e-3;
    int k = copied ? 1 : int(clamp(ceil(2.0 * sigma), float(LEAST_SAMPLES), float(MOST_SAMPLES)));
    color = vec4(0.0);
    for (int j = 0; j < k; ++j)
        for (int i = 0; i < k; ++i) {
            vec2 off = apart * ((vec2(i, j) + 0.5) / float(k) - 0.5);
            color += picture(whole, centre + off.x * jx + off.y * jy + (off.x * off.y) * bend);
        }
    color /= float(k * k);
#endif

#ifdef PREPARED
    // The overshoot of the cubic.
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
    color.rgb = floor(color.rgb * LEVELS + even_noise(pixel)) / LEVELS;
#endif
#ifdef PREPARED
    // Moved by whole pixels, and above all not at all: the very values of the picture.
    vec2 nearest = floor(centre);
    vec2 place = whole - u_corner + nearest + 0.5;
    copied = copied && all(lessThan(abs(centre - nearest - 0.5), vec2(1.0 / 1024.0)))
          && all(greaterThan(place, vec2(0.0))) && all(lessThan(place, u_extent));
    if (copied)
        color = texture(u_raw, place / vec2(textureSize(u_raw, 0)));
#endif
#ifdef GREY_ALPHA
    color.g = color.a;
#endif
    out_color = color;
}
