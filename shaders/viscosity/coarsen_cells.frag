// Coarsen: K of e_xx and e_yy on the next coarser level, S' K S / 16 (equation V4). A fine row counts 3/4 to the coarse
// row it lies in and 1/4 to the nearest other one; where one of the two does not move, and is glided along, the other
// counts whole. Of e_yy that holds for the columns.
// u_xx0 ... u_yy2: of the finer level, as in stress.frag, on the finest u_xx0 only, with u_aspect; u_open: of the coarse one;
// u_alone: see restrict.frag.
// reads: 64
#include "viscosity/openness.glsl"
#include "viscosity/sides.glsl"
#include "viscosity/fine_level.glsl"
uniform sampler2D u_xx0;
uniform sampler2D u_xx1;
uniform sampler2D u_xx2;
uniform sampler2D u_yy0;
uniform sampler2D u_yy1;
uniform sampler2D u_yy2;
uniform float u_aspect; // K of e_yy over K of e_xx
uniform vec2 u_alone;
layout(location = 0) out vec4 out_xx0;
layout(location = 1) out vec4 out_xx1;
layout(location = 2) out vec4 out_xx2;
layout(location = 3) out vec4 out_yy0;
layout(location = 4) out vec4 out_yy1;
layout(location = 5) out vec4 out_yy2;

#ifdef FINE_IS_FINEST
const int FARTHEST = 0;
#else
const int FARTHEST = 2;
#endif

// Below all is said of e_xx, the texel's two columns at once; `turned`, of e_yy, rows are columns.
vec2 live[8];  // whether the coarse rows from two before the first one on have strains; none beyond the grid
vec2 k[18];    // K of the fine rows from one before the first coarse one on, summed across; by 6 the coupled ones

ivec2 turn(ivec2 at, bool turned) { return turned ? at.yx : at; }
vec4 turn(vec4 cells, bool turned) { return turned ? cells.xzyw : cells; }

void read_live(bool turned) {
    ivec2 size = textureSize(u_xx0, 0) - 2, texel = ivec2(own_texel()); // a coarse cell for each texel
    for (int q = 0; q < 4; ++q) {
        ivec2 at = texel + turn(ivec2(0, q - 1), turned), next = at + turn(ivec2(1, 0), turned);
        vec4 here = turn(turned ? open_v(vec2(at)) : open_u(vec2(at)), turned);
        vec4 there = turn(turned ? open_v(vec2(next)) : open_u(vec2(next)), turned);
        ivec2 first = 2 * turn(at, turned), end = turn(size, turned);
        vec4 glide = glides(vec4(first.yy, first.yy + 1), turned ? u_box.x : u_box.y,
                            turned ? sides_across(u_no_slip.xy, u_alone.x) : sides_across(u_no_slip.zw, u_alone.y));
        vec4 moves = max(max(here, vec4(here.y, there.x, here.w, there.z)), 1.0 - glide);
        moves *= float(first.y >= 0) * vec4(lessThan(ivec4(first.yy, first.yy + 1), end.yyyy));
        live[2 * q] = moves.xy;
        live[2 * q + 1] = moves.zw;
    }
}

void read_fine(sampler2D fine_k, int offset, bool turned) {
    for (int q = 0; q < 8; ++q) {
        vec4 cells = turn(fine(fine_k, fine_texel() + turn(ivec2(q % 2, q / 2 - 1), turned)), turned);
        vec2 sums = cells.xz + cells.yw;
        int row = 2 * (q / 2) - 1;
        if (row >= 0) k[6 * offset + row][q % 2] = sums.x;
        if (row < 5) k[6 * offset + row + 1][q % 2] = sums.y;
    }
}

// What the fine row `place` rows after the first one of a coarse row counts to that.
vec2 weight(int row, int place) {
    vec2 other = place < 1 ? live[row + 1] : live[row + 3];
    return mix(vec2(1.0), vec2(place == 0 || place == 1 ? 0.75 : 0.25), other);
}

// K of a coarse row, the texel's first or second, with the one `offset` rows further.
vec2 coarse(int row, int offset) {
    vec2 total = vec2(0.0);
    for (int place = -1; place < 3; ++place)
        for (int other = -1; other < 3; ++other) {
            int away = other + 2 * offset - place;
            if (abs(away) <= FARTHEST)
                total += weight(row, place) * weight(row + offset, other) * k[6 * abs(away) + 1 + 2 * row + place + min(away, 0)];
        }
    return total * u_alone.x * u_alone.y / 16.0;
}

vec4 coarse(int offset, bool turned) {
    // Rows beyond the grid are none.
    ivec2 first = 2 * turn(ivec2(own_texel()), turned), end = turn(textureSize(u_xx0, 0) - 2, turned);
    bvec2 here = lessThan(ivec2(first.y, first.y + 1), end.yy), there = lessThan(ivec2(first.y, first.y + 1) + offset, end.yy);
    bvec2 across = lessThan(ivec2(first.x, first.x + 1), end.xx);
    vec2 upper = here.x && there.x ? coarse(0, offset) : vec2(0.0), lower = here.y && there.y ? coarse(1, offset) : vec2(0.0);
    return turn(vec4(upper, lower) * vec2(across).xyxy, turned);
}

void main() {
    read_live(false);
    read_fine(u_xx0, 0, false);
#ifndef FINE_IS_FINEST
    read_fine(u_xx1, 1, false);
    read_fine(u_xx2, 2, false);
#endif
    out_xx0 = coarse(0, false);
    out_xx1 = coarse(1, false);
    out_xx2 = coarse(2, false);
    read_live(true);
#ifdef FINE_IS_FINEST
    read_fine(u_xx0, 0, true);
    for (int q = 0; q < 6; ++q) k[q] *= u_aspect;
#else
    read_fine(u_yy0, 0, true);
    read_fine(u_yy1, 1, true);
    read_fine(u_yy2, 2, true);
#endif
    out_yy0 = coarse(0, true);
    out_yy1 = coarse(1, true);
    out_yy2 = coarse(2, true);
}
