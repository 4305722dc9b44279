// Viscosities before they are packed, one texel a cell: R, G = K of u_x and of v_y in the cell, B = K of its upper left
// node if no wall touched it, A = 1 if its left face is open (moves), plus 2 if its upper face is; 0 K where no fluid is.
uniform sampler2D u_cells;

vec4 cell(ivec2 c) {
    ivec2 size = textureSize(u_cells, 0);
    return any(lessThan(c, ivec2(0))) || any(greaterThanEqual(c, size)) ? vec4(0.0) : texelFetch(u_cells, c, 0);
}
bool left_open(vec4 cell) { return mod(cell.a, 2.0) > 0.5; }
bool upper_open(vec4 cell) { return cell.a > 1.5; }
