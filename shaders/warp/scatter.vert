// Scatter: the cells of the map as triangles, drawn where they are looked up in the original.
// u_displacement (D): cell centres, longer sides; u_extent: width and height of the domain, longer sides.
// The corners are the cell centres, and around them the edge of the domain, moved like the nearest centre.
uniform sampler2D u_displacement;
uniform vec2 u_extent;
out vec2 v_place;

void main() {
    ivec2 size = textureSize(u_displacement, 0), cells = size + 1;
    int cell = gl_VertexID / 6, turn = gl_VertexID % 6;
    // Two triangles: (0 0) (1 0) (0 1) and (0 1) (1 0) (1 1).
    ivec2 corner = ivec2(turn == 1 || turn > 3 ? 1 : 0, turn == 2 || turn == 3 || turn == 5 ? 1 : 0);
    ivec2 node = ivec2(cell % cells.x, cell / cells.x) + corner;
    v_place = clamp((vec2(node) - 0.5) / vec2(size), 0.0, 1.0);
    vec2 moved = v_place + texelFetch(u_displacement, clamp(node - 1, ivec2(0), size - 1), 0).rg / u_extent;
    gl_Position = vec4(moved * 2.0 - 1.0, 0.0, 1.0);
}
