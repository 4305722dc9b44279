// Canvas: what lies under a pixel of the screen: the picture through the warp map, on a checkerboard, with its overlays.
//   colour(x) = picture(x + D(x)),  x = (pixel - u_origin) u_step  in 0-1 of the picture
// u_picture: premultiplied, sRGB; u_displacement (D): longer sides, linear filtering, over u_shown: left, top, width and
// height, 0-1 of the picture; u_extent: width and height in longer sides. EDGES: see lib/beyond.glsl. SPLIT: left of u_split
// the picture is as it was. CHECKER: something may be transparent; u_tile: side of a square of the checkerboard, pixels.
// SEEN: u_seen, what picture.frag draws, is what is seen of it, its first pixel at u_corner. MOVED, in
// mode "density": u_moved, the whole picture as the fluid has carried its colours, is shown in place of it.
// What is not asked for is left out by defines: a software rasteriser goes through both sides of every branch.
// GRID: lines of the picture's own coordinates, u_grid of them along the longer side. MASKS: u_masks, what masks.frag draws,
// its first pixel at u_corner too. ROOM: a tint where u_room, over the picture, swells or shrinks.
// SELECTED: dashes of half u_dash pixels along the edge of where u_selected is 1/2 or more, u_dash_width pixels wide to each side.
// The colours are told apart by those who do not see red and green apart (Okabe and Ito).
// reads: 2, and up to 13 with overlays
#include "lib/beyond.glsl"
uniform sampler2D u_picture;
uniform sampler2D u_displacement;
uniform vec2 u_origin;
uniform vec2 u_step;
uniform vec4 u_shown;
uniform vec2 u_extent;
#ifdef SPLIT
uniform float u_split;
#endif
#ifdef CHECKER
uniform vec3 u_light;
uniform vec3 u_dark;
uniform float u_tile;
#endif
uniform float u_target_height;
#ifdef GRID
uniform float u_grid;
uniform float u_grid_opacity;
uniform float u_pixel;
#endif
#ifdef MASKS
uniform sampler2D u_masks;
#endif
#ifdef SEEN
uniform sampler2D u_seen;
#endif
#ifdef MOVED
uniform sampler2D u_moved;
#endif
#if defined(MASKS) || defined(SEEN)
uniform vec2 u_corner;
#endif
#ifdef SELECTED
uniform sampler2D u_selected;
uniform float u_dash;
uniform float u_dash_width;
#endif
#ifdef ROOM
uniform sampler2D u_room;
uniform float u_room_opacity;
#endif
layout(location = 0) out vec4 out_colour;

#ifdef SELECTED
// Beyond the picture nothing is selected, so that its edge is one too.
bool selected(vec2 place) { return inside(place) * texture(u_selected, place).r >= 0.5; }
#endif

vec4 look_up(vec2 place) {
    place = repeated(place);
    return bounded(texture(u_picture, place), place);
}

void main() {
    vec2 pixel = vec2(gl_FragCoord.x, u_target_height - gl_FragCoord.y) - u_origin;
    vec2 x = pixel * u_step;
#ifdef SPLIT
    bool warped = x.x >= u_split;
#else
    const bool warped = true;
#endif
    vec2 place = x;
    if (warped) place += texture(u_displacement, (x - u_shown.xy) / u_shown.zw).rg / u_extent;
#ifdef SEEN
    vec4 colour = texture(u_seen, (gl_FragCoord.xy - u_corner) / vec2(textureSize(u_seen, 0)));
#elif defined(MOVED)
    vec4 colour = texture(u_moved, x);
#else
    vec4 colour = look_up(place);
#endif
#if defined(SPLIT) && (defined(SEEN) || defined(MOVED))
    vec4 unwarped = look_up(x);
    if (!warped) colour = unwarped;
#endif
#ifdef CHECKER
    if (colour.a < 0.999) {
        vec2 tile = floor(gl_FragCoord.xy / u_tile);
        colour.rgb += (1.0 - colour.a) * (mod(tile.x + tile.y, 2.0) < 0.5 ? u_light : u_dark);
    }
#endif
    vec3 seen = colour.rgb;
    if (warped) {
#ifdef MASKS
        vec4 masks = texture(u_masks, (gl_FragCoord.xy - u_corner) / vec2(textureSize(u_masks, 0)));
        seen = (1.0 - masks.a) * seen + masks.rgb;
#endif
#ifdef GRID
        vec2 lines = place * u_extent * u_grid;
        vec2 near = abs(fract(lines - 0.5) - 0.5);
        vec2 wide = max(fwidth(lines), 1e-5);
        vec2 line = 1.0 - smoothstep(0.3 * u_pixel, 1.1 * u_pixel, near / wide);
        // Where lines are closer than their own width, none can be told apart.
        line *= 1.0 - smoothstep(0.25, 0.6, wide);
        float shade = 1.0 - smoothstep(0.8 * u_pixel, 2.2 * u_pixel, min(near.x / wide.x, near.y / wide.y));
        seen = mix(seen, vec3(0.0), u_grid_opacity * 0.35 * shade);
        seen = mix(seen, vec3(1.0), u_grid_opacity * max(line.x, line.y));
#endif
#ifdef ROOM
        float room = texture(u_room, x).r;
        vec3 swelling = room > 0.0 ? vec3(0.90, 0.62, 0.0) : vec3(0.34, 0.71, 0.91);
        seen = mix(seen, swelling, u_room_opacity * 0.9 * sqrt(min(abs(room), 1.0)));
#endif
#ifdef SELECTED
        vec2 aside = u_dash_width * u_step;
        bool here = selected(x);
        if (here != selected(x + vec2(aside.x, 0.0)) || here != selected(x - vec2(aside.x, 0.0)) ||
            here != selected(x + vec2(0.0, aside.y)) || here != selected(x - vec2(0.0, aside.y)))
            seen = vec3(step(0.5, fract((gl_FragCoord.x + gl_FragCoord.y) / u_dash)));
#endif
    }
    out_colour = vec4(seen, 1.0);
}
