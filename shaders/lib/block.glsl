// The pressure's grids. A texel holds a block of 2 x 2 cells: x upper left, y upper right, z lower left, w lower right.
// A block of one level is one cell of the next. How open the faces of a block's cells are is kept in three textures, so
// that walls, solids and the padding of odd sizes are all just closed faces. It is 0 (wall) or 1 on the finest level; on
// coarser ones the open length of the face over the distance between the two centres, in cells of the level. The last
// cell of a row or column is narrower where the grid's size does not halve evenly, and its neighbour's centre nearer.
//   left  the four cells' left faces,   up  their upper faces,
//   far   the block's right faces (x upper, y lower) and its lower faces (z left, w right).
struct Faces {
    vec4 left, right, up, down;  // of each of the four cells
};

Faces faces_of(vec4 left, vec4 up, vec4 far) {
    return Faces(left, vec4(left.y, far.x, left.w, far.y), up, vec4(up.zw, far.zw));
}

vec4 openness(Faces f) { return f.left + f.right + f.up + f.down; }

// 1 for each cell that some face leads out of.
vec4 live(Faces f) { return vec4(greaterThan(openness(f), vec4(0.0))); }

// The part of a block that its coarse cell stands for, 1 for each cell of it: the largest connected one. A thin wall cuts
// a block in two; a coarse cell for both sides would be a leak in the wall.
vec4 members(Faces f) {
    vec4 alive = live(f);
    bool top = f.left.y > 0.0, bottom = f.left.w > 0.0, left = f.up.z > 0.0, right = f.up.w > 0.0;
    if (int(top) + int(bottom) + int(left) + int(right) >= 3) return alive;
    float a_d = float(top && right || left && bottom), b_c = float(top && left || right && bottom);
    vec4 part = vec4(alive.x, top, left, a_d);
    vec4 of_b = vec4(top, alive.y, b_c, right), of_c = vec4(left, b_c, alive.z, bottom);
    vec4 of_d = vec4(a_d, right, bottom, alive.w);
    const vec4 one = vec4(1.0);
    if (dot(of_b, one) > dot(part, one)) part = of_b;
    if (dot(of_c, one) > dot(part, one)) part = of_c;
    if (dot(of_d, one) > dot(part, one)) part = of_d;
    return part;
}
