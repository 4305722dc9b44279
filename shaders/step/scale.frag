// Scale packed faces.
// u_u, u_v: packed as viscosity/operator.glsl has it; u_factor.
// reads: 2
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform float u_factor;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

void main() {
    out_u = u_factor * texture(u_u, v_uv);
    out_v = u_factor * texture(u_v, v_uv);
}
