// Picture: what the canvas shows of a picture at rest, through the warp map: the mean of samples spread evenly over each
// pixel of the screen, as an export has them, so that no texel is passed over where the map presses the picture together.
//   colour(x) = mean of picture(y + D(y)),  y in the pixel at x; origin, step, shown, extent, D and EDGES: see canvas.frag
// Along x and along y there are so many that none are farther apart than u_spacing (0-1 of the picture): texels, or where
// the picture is seen smaller what lies between two pixels; a quarter more is not to be seen.
// Several are added up in linear light. u_picture: premultiplied, sRGB, its version of half so many texels a side u_level times.
// reads: 6, and 2 more for each sample above 1 where the picture is pressed
#include "lib/beyond.glsl"
#include "lib/srgb.glsl"
uniform sampler2D u_picture;
uniform sampler2D u_displacement;
uniform vec2 u_origin;
uniform vec2 u_step;
uniform vec4 u_shown;
uniform vec2 u_extent;
uniform vec2 u_spacing;
uniform float u_level;
uniform float u_target_height;
layout(location = 0) out vec4 out_colour;

vec4 look_up(vec2 place) {
    place = repeated(place);
    return bounded(textureLod(u_picture, place, u_level), place);
}

// From code values to light and back, both premultiplied.
vec4 light_of(vec4 colour) { return vec4(srgb_to_linear(colour.rgb / max(colour.a, 1e-3)) * colour.a, colour.a); }
vec4 code_of(vec4 light) { return vec4(linear_to_srgb(light.rgb / max(light.a, 1e-3)) * light.a, light.a); }

const float MOST = 8.0;  // samples a direction, as in an export

vec2 place_at(vec2 pixel) {
    vec2 x = pixel * u_step;
    return x + texture(u_displacement, (x - u_shown.xy) / u_shown.zw).rg / u_extent;
}

void main() {
    vec2 pixel = vec2(gl_FragCoord.x, u_target_height - gl_FragCoord.y) - u_origin;
    vec2 a = place_at(pixel + vec2(-0.5, -0.5)), b = place_at(pixel + vec2(0.5, -0.5));
    vec2 c = place_at(pixel + vec2(-0.5, 0.5)), d = place_at(pixel + vec2(0.5, 0.5));
    vec2 side = vec2(max(length((b - a) / u_spacing), length((d - c) / u_spacing)),
                     max(length((c - a) / u_spacing), length((d - b) / u_spacing)));
    vec2 count = clamp(ceil(side - 0.25), 1.0, MOST);
    if (count == vec2(1.0)) {
        out_colour = look_up(place_at(pixel));
        return;
    }
    vec4 sum = vec4(0.0);
    for (float j = 0.5; j < count.y; ++j)
        for (float i = 0.5; i < count.x; ++i)
            sum += light_of(look_up(place_at(pixel + vec2(i, j) / count - 0.5)));
    out_colour = code_of(sum / (count.x * count.y));
}
