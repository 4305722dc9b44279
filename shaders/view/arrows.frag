// Arrows: one in every square, with its shade, premultiplied, to be laid over the canvas.
// v_tile, v_arrow: see arrows.vert; u_side: of a square, pixels; u_origin, u_step, u_target_height: see canvas.frag.
// SPLIT: left of u_split the picture is as it was, without arrows.
// vertices: view/arrows.vert
// reads: 0
uniform vec2 u_origin;
uniform vec2 u_step;
uniform float u_target_height;
uniform float u_side;
uniform float u_opacity;
uniform vec3 u_colour;
#ifdef SPLIT
uniform float u_split;
#endif
flat in vec2 v_tile;
flat in vec3 v_arrow;
layout(location = 0) out vec4 out_colour;

// Coverage of an arrow of length 0-1 at q, along and beside it, in a square from -1 to 1, whose pixel is `soft` wide.
float arrow(vec2 q, float size, float soft) {
    if (size < 0.1) return 0.0;
    float reach = 0.9 * min(size, 1.0), head = min(0.5, reach);
    float shaft = max(q.y - 0.07, max(-reach - q.x, q.x - reach + head));
    float tip = max(0.5 * (q.x - reach) + q.y, reach - head - q.x);
    return 1.0 - smoothstep(-soft, soft, min(shaft, tip));
}

void main() {
    vec2 pixel = vec2(gl_FragCoord.x, u_target_height - gl_FragCoord.y) - u_origin;
#ifdef SPLIT
    if (pixel.x * u_step.x < u_split) discard;
#endif
    vec2 p = (pixel - v_tile) / (0.5 * u_side);
    vec2 q = vec2(dot(p, v_arrow.xy), abs(p.y * v_arrow.x - p.x * v_arrow.y));
    float soft = 2.0 / u_side;
    float shade = u_opacity * 0.6 * arrow(0.9 * q, 1.12 * v_arrow.z, 2.0 * soft);
    float light = u_opacity * arrow(q, v_arrow.z, soft);
    out_colour = vec4(light * u_colour, 1.0 - (1.0 - shade) * (1.0 - light));
}
