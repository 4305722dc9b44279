// Add a source of density: phi + dt S, drawn with additive blending (equation (5), third term).
// u_source: density / s; u_dt: seconds.
// reads: 1
uniform sampler2D u_source;
uniform float u_dt;
in vec2 v_uv;
layout(location = 0) out vec4 out_density;

void main() {
    out_density = u_dt * texture(u_source, v_uv);
}
