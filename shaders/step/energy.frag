// Energy: what the viscous step has left of the energy of w1, of the faces in a texel (equation S5).
// u_u, u_v: w3, packed as viscosity/operator.glsl has it, lengths / s; u_departed: |w1|^2 of the same faces.
// squares: |w3|^2, |w1|^2.
// reads: 3
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_departed;
in vec2 v_uv;
layout(location = 0) out vec2 out_squares;

void main() {
    vec4 u = texture(u_u, v_uv), v = texture(u_v, v_uv);
    out_squares = vec2(dot(u, u) + dot(v, v), texture(u_departed, v_uv).r);
}
