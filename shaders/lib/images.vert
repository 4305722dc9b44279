// The rectangle that each image of a brush reaches over, with a cell to spare, as two triangles.
// u_segments: see lib/images.glsl; u_images: how many; u_vectors: what each does, see the fragment shader; u_spacing: sides of
// a cell, lengths; u_texels: of the target, across and down.
// v_segment, v_vector: of the image; v_number: which it is; v_share: the part of a motion that it gives, one over the sum of
// the weights of all at its end: where they overlap, they together give what one of them would alone.
#include "lib/images.glsl"
#include "lib/brush.glsl"
uniform vec2 u_vectors[MOST_IMAGES];
uniform float u_images;
uniform vec2 u_spacing;
uniform vec2 u_texels;
flat out vec4 v_segment;
flat out vec2 v_vector;
flat out int v_number;
flat out float v_share;

void main() {
    int turn = gl_VertexID % 6;
    v_number = gl_VertexID / 6;
    v_segment = u_segments[v_number];
    v_vector = u_vectors[v_number];
    float together = 1.0;
    for (int other = 0; other < int(u_images); ++other)
        together += other == v_number ? 0.0 : brush_weight(u_segments[other], v_segment.zw);
    v_share = 1.0 / together;
    vec2 low = (min(v_segment.xy, v_segment.zw) - u_radius) / u_spacing - 1.5;
    vec2 high = (max(v_segment.xy, v_segment.zw) + u_radius) / u_spacing + 1.5;
    // Two triangles: (0 0) (1 0) (0 1) and (0 1) (1 0) (1 1).
    vec2 corner = vec2(turn == 1 || turn > 3 ? 1.0 : 0.0, turn == 2 || turn == 3 || turn == 5 ? 1.0 : 0.0);
    gl_Position = vec4(mix(low, high, corner) / u_texels * 2.0 - 1.0, 0.0, 1.0);
}
