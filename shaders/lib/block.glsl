// The pressure's grids: a texel holds a block of 2 x 2 cells, x upper left, y upper right, z lower left, w lower right.
// A block of one level is one cell of the next. The weight of a link across a face is 0 (wall) or 1 on the finest level,
// and on coarser ones what the faces it stands for count together; a link down counts u_aspect^2 times that.
//   u_left  the four cells' left faces,   u_up  their upper faces,
//   u_far   the block's right faces (x upper, y lower) and its lower faces (z left, w right).
//   u_inverse   of each cell one over the sum of its links, 0 without any.
// With OPEN there are no solids, and the weights follow from u_span, the grid's size in cells of the level: the cells of
// the last row and column may be less than whole. One over the sum of an inner cell's links serves all.
#ifdef OPEN
uniform vec2 u_span;
#else
uniform sampler2D u_left;
uniform sampler2D u_up;
uniform sampler2D u_far;
uniform sampler2D u_inverse;
#endif
uniform float u_aspect;  // side of a cell along x over that along y

struct Links {
    vec4 left, right, up, down;  // of each of the four cells
};

// 3 reads; none with OPEN.
Links links_of(vec2 block, vec2 uv) {
    float down = u_aspect * u_aspect;
#ifdef OPEN
    // How much of the block's first and second cell there is, and whether there are cells before, in and behind its second.
    vec2 first = 2.0 * block, part = clamp(u_span - first, 0.0, 1.0), second = clamp(u_span - first - 1.0, 0.0, 1.0);
    vec2 near = vec2(greaterThan(first, vec2(0.5))), inner = vec2(greaterThan(second, vec2(0.0)));
    vec2 far = vec2(greaterThan(u_span, first + 2.0));
    vec4 columns = down * vec2(part.x, second.x).xyxy, rows = vec2(part.y, second.y).xxyy;
    return Links(rows * vec2(near.x, inner.x).xyxy, rows * vec2(inner.x, far.x).xyxy,
                 columns * vec2(near.y, inner.y).xxyy, columns * vec2(inner.y, far.y).xxyy);
#else
    vec4 left = texture(u_left, uv), up = down * texture(u_up, uv), far = texture(u_far, uv) * vec2(1.0, down).xxyy;
    return Links(left, vec4(left.y, far.x, left.w, far.y), up, vec4(up.zw, far.zw));
#endif
}

vec4 inverse_diagonal(vec2 uv) {
#ifdef OPEN
    return vec4(0.5 / (1.0 + u_aspect * u_aspect));
#else
    return texture(u_inverse, uv);
#endif
}

// A p of a block: the sum over the links of their weight times the difference across, in the unit of p; `l`, `r`, `u` and
// `d` are p of the blocks around it. Taken of differences, it is as exact as these are, however large the pressure.
vec4 laplacian(vec4 l, vec4 r, vec4 u, vec4 d, vec4 here, Links f) {
    return f.left * (vec4(l.y, here.x, l.w, here.z) - here) + f.right * (vec4(here.y, r.x, here.w, r.z) - here)
         + f.up * (vec4(u.zw, here.xy) - here) + f.down * (vec4(here.zw, d.xy) - here);
}

// 4 reads.
vec4 laplacian(sampler2D p, vec2 uv, vec4 here, Links f) {
    vec2 texel = 1.0 / vec2(textureSize(p, 0)), across = vec2(texel.x, 0.0), down = vec2(0.0, texel.y);
    return laplacian(texture(p, uv - across), texture(p, uv + across), texture(p, uv - down), texture(p, uv + down), here, f);
}
