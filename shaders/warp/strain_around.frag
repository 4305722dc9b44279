// Strain around: of what strain.frag has drawn on a lattice, in a row (x) of the box about each (y) of some places: the least
// det J; the square of the largest stretch, how many times farther apart in the original a place and the one to its left, or
// the one above it, lie; the least area between texels; and the least part of both that is left of what is expected, 1 or,
// with EXPECTED, e^u_expected over the picture.
// u_strain: from the place u_corner of the lattice on; u_count: places of the whole lattice, across and down; u_boxes: left,
// top, right, bottom, places of it; u_step: how far apart these are, longer sides; u_last:
// where none lies beyond, as in strain.frag.
// reads: 2, and 2 for each place of a row, 6 with EXPECTED
#ifdef EXPECTED
#include "lib/displacement.glsl"
uniform sampler2D u_expected;
#endif
uniform sampler2D u_strain;
uniform sampler2D u_boxes;
uniform vec2 u_corner;
uniform vec2 u_count;
uniform vec2 u_step;
uniform vec2 u_last;
layout(location = 0) out vec4 out_strain;

vec4 at(float column, float row) {
    return texture(u_strain, (vec2(column, row) - u_corner + 0.5) / vec2(textureSize(u_strain, 0)));
}

// The square of how many times farther apart two places lie, the one in front `back` from the other.
float stretch(vec2 place, vec2 back, vec2 moved) {
    if (any(lessThan(place, back))) return 0.0;
    vec2 way = min((place + 0.5) * u_step, u_last) - min((place + 0.5 - back) * u_step, u_last);
    return dot(way + moved, way + moved) / max(dot(way, way), 1e-20);
}

void main() {
    vec4 box = texelFetch(u_boxes, ivec2(0, int(gl_FragCoord.y)), 0);
    float row = box.y + floor(gl_FragCoord.x);
    vec4 found = vec4(1e30, 0.0, 1e30, 1e30);
    vec4 left = at(box.x - 1.0, row);
    if (row < box.w)
        for (float column = box.x; column < box.z; ++column) {
            vec4 here = at(column, row), above = at(column, row - 1.0);
            vec2 place = vec2(column, row);
            float most = max(stretch(place, vec2(1.0, 0.0), here.xy - left.xy), stretch(place, vec2(0.0, 1.0), here.xy - above.xy));
            float left_over = min(here.z, here.w);
#ifdef EXPECTED
            vec2 p = (place + 0.5) / u_count * vec2(textureSize(u_expected, 0));
            left_over /= exp(linear_texels(u_expected, p).r);
#endif
            found = vec4(min(found.x, here.z), max(found.y, most), min(found.z, here.w), min(found.w, left_over));
            left = here;
        }
    out_strain = found;
}
