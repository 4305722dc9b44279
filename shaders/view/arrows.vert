// The squares of the screen that arrows are drawn in, as two triangles each; of what is too weak to be seen, none.
// u_field: what they show, linear filtering, over u_window: left, top, width and height, 0-1 of the picture; u_most: what fills
// one; u_side: of a square, pixels; u_first, u_across: the first square, counted from the picture's corner, and how many in a
// row; u_origin, u_step, u_target_height: see canvas.frag; u_viewport: left, bottom, width and height, pixels.
// v_tile: the middle of the square, pixels; v_arrow: its direction, and its length, 0-1, of weak ones longer than in
// proportion, or nothing but the strongest would be seen.
uniform sampler2D u_field;
uniform vec4 u_window;
uniform vec4 u_viewport;
uniform vec2 u_first;
uniform vec2 u_origin;
uniform vec2 u_step;
uniform float u_across;
uniform float u_most;
uniform float u_side;
uniform float u_target_height;
flat out vec2 v_tile;
flat out vec3 v_arrow;

void main() {
    int each = gl_VertexID / 6, turn = gl_VertexID % 6, across = int(u_across);
    v_tile = (u_first + vec2(each % across, each / across) + 0.5) * u_side;
    vec2 at = (v_tile * u_step - u_window.xy) / u_window.zw;
    vec2 v = texture(u_field, at).rg / u_most;
    float size = length(v);
    bool seen = size > 0.0 && all(greaterThanEqual(at, vec2(0.0))) && all(lessThanEqual(at, vec2(1.0)));
    v_arrow = seen ? vec3(v / size, pow(min(size, 1.0), 0.4)) : vec3(0.0);
    // Two triangles: (0 0) (1 0) (0 1) and (0 1) (1 0) (1 1); from 0.08 on its shade would be seen.
    vec2 corner = vec2(turn == 1 || turn > 3 ? 0.5 : -0.5, turn == 2 || turn == 3 || turn == 5 ? 0.5 : -0.5);
    // No more of the square than the shade covers, see arrows.frag, and a pixel around it.
    float reach = 0.9 * min(1.12 * v_arrow.z, 1.0), soft = 2.0 / u_side;
    float along = (reach + 2.0 * soft) / 0.9 + soft;
    float beside = max(0.5 * min(0.5, reach) + 3.0 * soft, 0.07 + 2.0 * soft) / 0.9 + soft;
    vec2 covered = min(abs(v_arrow.xy) * along + abs(v_arrow.yx) * beside, vec2(1.0));
    vec2 pixel = v_tile + u_origin + (v_arrow.z > 0.08 ? corner * covered : vec2(0.0)) * u_side;
    vec2 place = vec2(pixel.x, u_target_height - pixel.y);
    gl_Position = vec4((place - u_viewport.xy) / u_viewport.zw * 2.0 - 1.0, 0.0, 1.0);
}
