// Energy: what the viscous step has left of the energy of w1, of the faces in a block of texels (equation S5).
// u_u, u_v: w3, packed as viscosity/operator.glsl has it, lengths / s; u_departed: |w1|^2 of the same faces; u_side:
// texels along a block. With PARTIAL each square times the open part of its face, u_left and u_up of lib/block.glsl.
// squares: |w3|^2, |w1|^2.
// reads: 192, and 320 with PARTIAL
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_departed;
uniform float u_side;
#ifdef PARTIAL
uniform sampler2D u_left;
uniform sampler2D u_up;
#endif
layout(location = 0) out vec2 out_squares;

void main() {
    vec2 size = vec2(textureSize(u_u, 0)), texel = 1.0 / size;
    vec2 first = u_side * floor(gl_FragCoord.xy) + 0.5, end = min(first + u_side - 0.5, size);
    out_squares = vec2(0.0);
    for (float y = first.y; y < end.y; ++y)
        for (float x = first.x; x < end.x; ++x) {
            vec2 at = vec2(x, y) * texel;
            vec4 u = texture(u_u, at), v = texture(u_v, at);
#ifdef PARTIAL
            vec2 block = (floor(vec2(x, y)) - 0.5) / vec2(textureSize(u_left, 0));
            float left = dot(texture(u_left, block), u * u) + dot(texture(u_up, block), v * v);
#else
            float left = dot(u, u) + dot(v, v);
#endif
            out_squares += vec2(left, texture(u_departed, at).r);
        }
}
