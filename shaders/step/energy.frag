// Energy: what the viscous step has left of the energy of w1, of the faces in a texel (equation S5).
// u_u, u_v: w3, packed as viscosity/operator.glsl has it, lengths / s; u_departed: |w1|^2 of the same faces.
// With PARTIAL each square times the open part of its face, u_left and u_up of lib/block.glsl.
// squares: |w3|^2, |w1|^2.
// reads: 3, and 5 with PARTIAL
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_departed;
#ifdef PARTIAL
uniform sampler2D u_left;
uniform sampler2D u_up;
#endif
in vec2 v_uv;
layout(location = 0) out vec2 out_squares;

void main() {
    vec4 u = texture(u_u, v_uv), v = texture(u_v, v_uv);
#ifdef PARTIAL
    vec2 block = (floor(gl_FragCoord.xy) - 0.5) / vec2(textureSize(u_left, 0));
    float left = dot(texture(u_left, block), u * u) + dot(texture(u_up, block), v * v);
#else
    float left = dot(u, u) + dot(v, v);
#endif
    out_squares = vec2(left, texture(u_departed, v_uv).r);
}
