// The texels of a canvas under a cell, in blocks of some texels a side where there are many, each looked at in its middle:
// at most 16 blocks along a cell; with fewer than 16 texels every one counts by the part of it that the cell covers.
uniform vec2 u_origin; // corner of the grid, 0-1 of the picture
uniform vec2 u_cell;   // sides of a cell, 0-1 of the picture

struct Texels {
    vec2 low;   // the cell, in texels
    vec2 high;
    vec2 first; // corner of the first block
    vec2 block; // its sides
};

Texels texels_under(vec2 cell, vec2 canvas) {
    vec2 low = (u_origin + cell * u_cell) * canvas, high = min(low + u_cell * canvas, canvas);
    return Texels(low, high, floor(low), max(floor(u_cell * canvas / 8.0), 1.0));
}

// The area of a block within the cell, in texels, and the texel that stands for it.
float block_area(Texels texels, vec2 corner) {
    vec2 sides = min(corner + texels.block, texels.high) - max(corner, texels.low);
    return sides.x * sides.y;
}

ivec2 block_texel(Texels texels, vec2 corner) { return ivec2(min(corner + floor(0.5 * texels.block), ceil(texels.high) - 1.0)); }
