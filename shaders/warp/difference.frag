// Difference: what a level S is read from between its cells, by Everett's formula with modified second differences (Comrie):
// of the fourth differences a part is thrown back on the second, so that the cubic between two cells is nearly as exact as
// the quintic of six. Drawn in two halves, as lib/displacement.glsl has them: above S and its second differences along both
// axes, and below, with BENDS, those along x and along y; each within a border of a cell, the image of the cells inside.
// u_displacement (S): cell centres; u_images: see lib/displacement.glsl. Next to an edge without images the cubic of the
// outermost cells goes on.
// reads: 10
#include "lib/displacement.glsl"
uniform sampler2D u_displacement;
uniform vec4 u_images;
layout(location = 0) out vec4 out_differences;

const float THROWN_BACK = 0.184;

vec2 at(vec2 cell, vec2 size) {
    vec4 ux, uy, vx, vy, x = imaged(cell.xxxx + 0.5, size.x, u_images.xy, ux, vx);
    vec4 y = imaged(cell.yyyy + 0.5, size.y, u_images.zw, vy, uy);
    return texture(u_displacement, vec2(x.x, y.x) / size).rg * vec2(ux.x * uy.x, vx.x * vy.x);
}

// The cell so many cells within the edges beyond which there is nothing.
vec2 inside(vec2 cell, vec2 size, float count) {
    vec4 margin = count - count * abs(u_images);
    return clamp(cell, margin.xz, size - 1.0 - margin.yw);
}

// The modified second difference along an axis, `far` from the middle one of five cells.
vec2 bent(vec2 middle, vec2 axis, float far, vec2 size) {
    vec2 a = at(middle - 2.0 * axis, size), b = at(middle - axis, size), c = at(middle, size), d = at(middle + axis, size);
    vec2 e = at(middle + 2.0 * axis, size), before = a - 2.0 * b + c, here = b - 2.0 * c + d, after = c - 2.0 * d + e;
    if (far == 0.0) return here - THROWN_BACK * (before - 2.0 * here + after);
    return here + abs(far) * ((far < 0.0 ? before : after) - here);
}

void main() {
    vec2 size = vec2(textureSize(u_displacement, 0)), place = gl_FragCoord.xy - 1.0;
#ifdef BENDS
    place.y -= size.y + 2.0;
#endif
    vec4 ux, uy, vx, vy, x = imaged(place.xxxx, size.x, u_images.xy, ux, vx);
    vec4 y = imaged(place.yyyy, size.y, u_images.zw, vy, uy);
    vec2 cell = vec2(x.x, y.x) - 0.5, count = vec2(ux.x * uy.x, vx.x * vy.x);
#ifdef BENDS
    vec2 middle = inside(cell, size, 2.0), far = cell - middle;
    vec2 along = bent(vec2(middle.x, cell.y), vec2(1.0, 0.0), far.x, size);
    out_differences = vec4(along, bent(vec2(cell.x, middle.y), vec2(0.0, 1.0), far.y, size));
#else
    vec2 middle = inside(cell, size, 1.0), both = vec2(0.0);
    for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i)
            both += (i == 0 ? -2.0 : 1.0) * (j == 0 ? -2.0 : 1.0) * at(middle + vec2(i, j), size);
    out_differences = vec4(at(cell, size), both);
#endif
    out_differences *= count.xyxy;
}
