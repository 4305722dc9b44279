// The warp map as its parts: submaps on windows of the picture, the identity outside them, then the accumulated map.
//   D(x) = S(x) + A(x + S(x));   with LEVELS defined as 2 or 3, with the submaps that are still to be taken into A,
//   D(x) = S + S2 + S3 + A, each where those before it have led; with CLOSED defined as 1 to 9, with so many fields after
//   A, the last one closed first: closed maps, and where UNDONE has their bit, what the restore brush has taken away of all
//   that follows. A place that is looked up in the next part is kept in the picture, and x + D(x) within u_limits, as all
//   texels are: between them a polynomial exceeds them, and composed again and again that would grow without end.
// u_box_0 to u_box_8: where a closed map begins, in texels of A, and its own texels for each of these.
// u_submap, u_second, u_third: what submaps are read from, see warp/difference.frag; u_accumulated, u_closed_0 to u_closed_8:
// displacements, longer sides, and of what is undone the part, 0-1, in the third component; u_window, u_second_window,
// u_third_window: left, top, width and height that the submaps cover, u_picture: width and height of the picture, u_limits:
// left, top, right, bottom, longer sides; u_images, u_second_images, u_third_images: what lies beyond the windows' sides,
// u_edges, u_edges_0 to u_edges_8: beyond the picture's, of A and of closed maps, as in lib/displacement.glsl; all are 0 if
// something has crossed the edges.
// Define HELD if something is frozen, for u_held and u_kept, over A's texels: see is_held. Define WEIGHED for the submaps
// that are carried less and less before that, 1, 2 and 4 or their sum, and FADED: see weight.
#include "lib/displacement.glsl"
uniform sampler2D u_submap;
uniform sampler2D u_accumulated;
uniform vec4 u_window;
uniform vec4 u_images;
uniform vec2 u_picture;
uniform vec4 u_limits;
uniform vec4 u_edges;
#ifndef LEVELS
#define LEVELS 1
#endif
#if LEVELS > 1
uniform sampler2D u_second;
uniform vec4 u_second_window;
uniform vec4 u_second_images;
#endif
#if LEVELS > 2
uniform sampler2D u_third;
uniform vec4 u_third_window;
uniform vec4 u_third_images;
#endif
#ifndef CLOSED
#define CLOSED 0
#endif
#ifndef UNDONE
#define UNDONE 0
#endif
#define IS_UNDONE(number) ((UNDONE >> number & 1) != 0)
// THROUGH_CLOSED(GO) is GO(closed, box, edges, number) of each closed map, the last one closed first: GLSL 3.30 has no array
// of samplers to go through.
#define THROUGH_0(GO)
#if CLOSED > 0
uniform sampler2D u_closed_0;
uniform vec4 u_box_0;
uniform vec4 u_edges_0;
#define THROUGH_1(GO) GO(u_closed_0, u_box_0, u_edges_0, 0) THROUGH_0(GO)
#else
#define THROUGH_1(GO) THROUGH_0(GO)
#endif
#if CLOSED > 1
uniform sampler2D u_closed_1;
uniform vec4 u_box_1;
uniform vec4 u_edges_1;
#define THROUGH_2(GO) GO(u_closed_1, u_box_1, u_edges_1, 1) THROUGH_1(GO)
#else
#define THROUGH_2(GO) THROUGH_1(GO)
#endif
#if CLOSED > 2
uniform sampler2D u_closed_2;
uniform vec4 u_box_2;
uniform vec4 u_edges_2;
#define THROUGH_3(GO) GO(u_closed_2, u_box_2, u_edges_2, 2) THROUGH_2(GO)
#else
#define THROUGH_3(GO) THROUGH_2(GO)
#endif
#if CLOSED > 3
uniform sampler2D u_closed_3;
uniform vec4 u_box_3;
uniform vec4 u_edges_3;
#define THROUGH_4(GO) GO(u_closed_3, u_box_3, u_edges_3, 3) THROUGH_3(GO)
#else
#define THROUGH_4(GO) THROUGH_3(GO)
#endif
#if CLOSED > 4
uniform sampler2D u_closed_4;
uniform vec4 u_box_4;
uniform vec4 u_edges_4;
#define THROUGH_5(GO) GO(u_closed_4, u_box_4, u_edges_4, 4) THROUGH_4(GO)
#else
#define THROUGH_5(GO) THROUGH_4(GO)
#endif
#if CLOSED > 5
uniform sampler2D u_closed_5;
uniform vec4 u_box_5;
uniform vec4 u_edges_5;
#define THROUGH_6(GO) GO(u_closed_5, u_box_5, u_edges_5, 5) THROUGH_5(GO)
#else
#define THROUGH_6(GO) THROUGH_5(GO)
#endif
#if CLOSED > 6
uniform sampler2D u_closed_6;
uniform vec4 u_box_6;
uniform vec4 u_edges_6;
#define THROUGH_7(GO) GO(u_closed_6, u_box_6, u_edges_6, 6) THROUGH_6(GO)
#else
#define THROUGH_7(GO) THROUGH_6(GO)
#endif
#if CLOSED > 7
uniform sampler2D u_closed_7;
uniform vec4 u_box_7;
uniform vec4 u_edges_7;
#define THROUGH_8(GO) GO(u_closed_7, u_box_7, u_edges_7, 7) THROUGH_7(GO)
#else
#define THROUGH_8(GO) THROUGH_7(GO)
#endif
#if CLOSED > 8
uniform sampler2D u_closed_8;
uniform vec4 u_box_8;
uniform vec4 u_edges_8;
#define THROUGH_CLOSED(GO) GO(u_closed_8, u_box_8, u_edges_8, 8) THROUGH_8(GO)
#else
#define THROUGH_CLOSED(GO) THROUGH_8(GO)
#endif
#if defined(HELD) || defined(WEIGHED)
uniform sampler2D u_held;
#endif
#ifdef HELD
uniform sampler2D u_kept;
#endif

// Where nothing is beyond the limits, nothing is added, so that the identity stays one to the bit.
vec2 within(vec4 limits, vec2 x, vec2 moved) { return moved + (clamp(x + moved, limits.xy, limits.zw) - (x + moved)); }

vec2 within_picture(vec2 x, vec2 moved) { return within(vec4(0.0, 0.0, u_picture), x, moved); }

// 0-1 of a window, and 1 in it, 0 outside.
vec3 in_window(vec4 window, vec2 x) {
    vec2 across = (x - window.xy) / window.zw, inside = step(abs(across - 0.5), vec2(0.5));
    return vec3(across, inside.x * inside.y);
}

// The part w of what a submap moves at x, 0-1, with its slopes along x and y, texels of A: a spline times a weight that is
// zero on a border is zero there too, continuously (Kantorovich and Krylov). w is 0 where the map is held and 1 from a cell
// of the submap on, or FADED texels: equation (S7).
#ifdef WEIGHED
float weight(int level, sampler2D submap, vec4 window, vec2 x, out vec2 slope) {
    slope = vec2(0.0);
    if ((WEIGHED & level) == 0) return 1.0;
    vec2 size = vec2(textureSize(u_held, 0)), place = x / u_picture * size - 0.5, texel = floor(place), f = place - texel;
    vec4 at = vec4(texel + 0.5, texel + 1.5) / size.xyxy;
    vec4 far = max(127.0 - 255.0 * vec4(texture(u_held, at.xy).r, texture(u_held, at.zy).r,
                                        texture(u_held, at.xw).r, texture(u_held, at.zw).r), 0.0);
    vec2 cell = window.zw / cells_of(submap) * size / u_picture, along = mix(far.xz, far.yw, f.x);
    float over = clamp(max(cell.x, cell.y), 1.0, float(FADED)), part = clamp(mix(along.x, along.y, f.y) / over, 0.0, 1.0);
    slope = 2.0 * (1.0 - part) / over * vec2(mix(far.y - far.x, far.w - far.z, f.y), along.y - along.x);
    return part * (2.0 - part);
}
#else
float weight(int level, sampler2D submap, vec4 window, vec2 x, out vec2 slope) {
    slope = vec2(0.0);
    return 1.0;
}
#endif

vec2 displacement_of(int level, sampler2D submap, vec4 window, vec4 images, vec2 x) {
    vec2 slope;
    vec3 at = in_window(window, x);
    vec2 moved = bent_displacement(submap, at.xy * cells_of(submap), images);
    return moved * at.z * weight(level, submap, window, x, slope);
}

// Where the submaps lead from x.
vec2 displacement_of_submaps(vec2 x) {
    vec2 moved = within_picture(x, displacement_of(1, u_submap, u_window, u_images, x));
#if LEVELS > 1
    moved = within_picture(x, moved + displacement_of(2, u_second, u_second_window, u_second_images, x + moved));
#endif
#if LEVELS > 2
    moved = within_picture(x, moved + displacement_of(4, u_third, u_third_window, u_third_images, x + moved));
#endif
    return moved;
}

#ifdef HELD
// A place on a texel, however it was rounded, is on its middle.
vec2 on_texel(vec2 place) {
    vec2 nearest = floor(place) + 0.5;
    return mix(place, nearest, lessThan(abs(place - nearest), vec2(1.0 / 512.0)));
}

// Whether the map is held at a place, in A's texels: where u_held is 1; on a texel, where it is not 0.
bool is_held(vec2 place) {
    float held = texture(u_held, place / vec2(textureSize(u_held, 0))).r;
    return held > (on_texel(place) == floor(place) + 0.5 ? 0.5 : 0.9);
}

// What it is there: u_kept on a texel, and between texels the cubic, which reaches none that moves. Along edges it glides
// whatever A does from then on, so that every bit stays.
vec2 held_displacement(vec2 place) { return cubic_displacement(u_kept, on_texel(place), abs(u_edges)); }
#endif

// A, a closed map or what is undone, at a place in its texels: by the cubic with CUBIC, bilinearly with LINEAR, else by the
// quintic.
vec4 accumulated_texels(sampler2D accumulated, vec2 place, vec4 edges) {
#if defined(LINEAR)
    return linear_texels(accumulated, place);
#elif defined(CUBIC)
    return cubic_texels(accumulated, place, edges);
#else
    return quintic_texels(accumulated, place, edges);
#endif
}

// A closed map, or what is undone, at a place in A's texels. Where its box ends within the picture its outermost texels are
// 0, and so is all beyond.
vec4 closed_texels(sampler2D closed, vec4 box, vec4 edges, vec2 place) {
    return accumulated_texels(closed, (place - box.xy) * box.zw, edges);
}

// Looks a closed map up where x has been led: x + moved + more, kept in the picture. `place` is x + moved in A's texels; it
// is moved along and not computed anew, so that it stays on its texel to the bit where nothing has moved.
void follow(sampler2D closed, vec4 box, vec4 edges, vec2 x, inout vec2 moved, inout vec2 more, inout vec2 place) {
    vec2 led = within_picture(x, moved + more) - moved;
    moved += led;
    place += led * vec2(textureSize(u_accumulated, 0)) / u_picture;
    more = closed_texels(closed, box, edges, place).rg;
}

// What the restore brush has undone at a place in A's texels: a way (E), and the part of what follows (T). E is read as A is,
// so that beneath the brush they add up to what A was also between texels. It leads from one place of the picture to another,
// and is kept as short as that: a polynomial overshoots, and E would grow from remap to remap.
vec3 undone_at(sampler2D undone, vec4 box, vec4 edges, vec2 place) {
    vec3 read = closed_texels(undone, box, edges, place).rgb;
    return vec3(clamp(read.rg, -u_picture, u_picture), clamp(read.b, 0.0, 1.0));
}

// Where x is led on to and D(x) are two things once something is undone: D(x) = back + part (x led to - x). Undoing leaves
// D(x) so far as it is, leads on by E as if nothing had been undone, and takes T away of the part. Where E and T are 0,
// nothing changes to the bit.
void undo(vec3 undone, vec2 moved, inout vec2 more, inout vec2 back, inout float part) {
    float left = part * (1.0 - undone.b);
    back += part * (moved + more) - left * (moved + more + undone.rg);
    part = left;
    more += undone.rg;
}

// D(x) of x that the submaps have `moved`, to `place` in A's texels.
vec2 displacement_from(vec2 x, vec2 moved, vec2 place) {
    vec2 more = accumulated_texels(u_accumulated, place, u_edges).rg, back = vec2(0.0);
    float part = 1.0;
#define UNDO(undone, box, edges) undo(undone_at(undone, box, edges, place), moved, more, back, part)
#define GO_ON(closed, box, edges) follow(closed, box, edges, x, moved, more, place)
#define FOLLOW(closed, box, edges, n) if (IS_UNDONE(n)) UNDO(closed, box, edges); else GO_ON(closed, box, edges);
    THROUGH_CLOSED(FOLLOW)
#undef FOLLOW
#undef GO_ON
#undef UNDO
    moved += more;
#if UNDONE > 0
    moved = back + part * moved;
#endif
    return within(u_limits, x, moved);
}

// D(x).
vec2 displacement_at(vec2 x) {
    vec2 density = vec2(textureSize(u_accumulated, 0)) / u_picture;
#ifdef HELD
    if (is_held(x * density)) return within(u_limits, x, held_displacement(x * density));
#endif
    vec2 moved = displacement_of_submaps(x);
    return displacement_from(x, moved, (x + moved) * density);
}
