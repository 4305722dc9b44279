// Compose: D(x), the displacement of the whole map: see lib/warp.glsl; x: see lib/place.glsl.
// Define REMAP if the fragments are the texels of A: then A stays the same to the bit where nothing has moved.
// Define CUBIC to read A by the cubic: where it has four texels a cell, or if the result will be interpolated again.
// Define LINEAR to read A bilinearly, for a target whose texels are no closer together than those of A.
// Define GATHER for the composition of the submaps alone.
// Define CARRY (with REMAP) to draw u_undone, what the restore brush has undone, where the submaps lead, in place of A.
// Define KEEP (with REMAP) to draw only what is newly held: where u_now, whose first texel is u_corner, is 1/2 or more, and
// u_before, over the picture, is not.
// Define FROM for W(x + P(x)) - x: u_from (P), texel for texel, longer sides.
// reads: 44, and 20 with CUBIC, 12 with LINEAR, 8 with GATHER; 8 more for each of LEVELS above 1, 4 for each
// of WEIGHED, and for each of CLOSED as many as A takes
#include "lib/warp.glsl"
#include "lib/place.glsl"
#ifdef KEEP
uniform sampler2D u_now;
uniform sampler2D u_before;
uniform vec2 u_corner;
#endif
#ifdef FROM
uniform sampler2D u_from;
in vec2 v_uv;
#endif
#ifdef CARRY
uniform sampler2D u_undone;
layout(location = 0) out vec4 out_displacement;
#else
layout(location = 0) out vec2 out_displacement;
#endif

void main() {
    vec2 size = vec2(textureSize(u_accumulated, 0)), texel = u_picture / size;
#ifdef REMAP
    vec2 place = gl_FragCoord.xy;
#else
    vec2 place = fragment_place() * size;
#endif
#ifdef KEEP
    if (texture(u_now, (place - u_corner) / vec2(textureSize(u_now, 0))).r < 0.5 || texture(u_before, place / size).r >= 0.5)
        discard;
#endif
    vec2 from = vec2(0.0);
#ifdef FROM
    from = within_picture(place * texel, texture(u_from, v_uv).rg);
    place += from / texel;
#endif
    vec2 x = place * texel;
#ifdef HELD
    if (is_held(place)) {
        out_displacement = from + within(u_limits, x, held_displacement(place));
        return;
    }
#endif
    vec2 moved = displacement_of_submaps(x);
#ifdef GATHER
    out_displacement = moved;
    return;
#endif
    place += moved / texel;
#ifdef CARRY
    out_displacement = vec4(undone_at(u_undone, vec4(0.0, 0.0, 1.0, 1.0), u_edges, place), 0.0);
#else
    out_displacement = from + displacement_from(x, moved, place);
#endif
}
