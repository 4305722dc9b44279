// The square that each brush out of a list reaches over, with a cell to spare, as two triangles.
// u_brushes: two texels each: x, y (from the grid's corner), radius (lengths), 0; then what
// it does, a vector (lengths / s); u_spacing: sides of a cell, lengths; u_texels: of the target, across and down.
uniform sampler2D u_brushes;
uniform vec2 u_spacing;
uniform vec2 u_texels;
flat out vec4 v_brush;
flat out vec4 v_vector; // and u_spacing

void main() {
    int each = gl_VertexID / 6, turn = gl_VertexID % 6, a_row = textureSize(u_brushes, 0).x / 2;
    ivec2 texel = ivec2(each % a_row * 2, each / a_row);
    v_brush = texelFetch(u_brushes, texel, 0);
    v_vector = vec4(texelFetch(u_brushes, texel + ivec2(1, 0), 0).xy, u_spacing);
    // Two triangles: (0 0) (1 0) (0 1) and (0 1) (1 0) (1 1).
    vec2 corner = vec2(turn == 1 || turn > 3 ? 1.0 : -1.0, turn == 2 || turn == 3 || turn == 5 ? 1.0 : -1.0);
    vec2 place = (v_brush.xy + v_brush.z * corner) / u_spacing + 0.5 + corner;
    gl_Position = vec4(place / u_texels * 2.0 - 1.0, 0.0, 1.0);
}
