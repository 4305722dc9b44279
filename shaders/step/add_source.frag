// Add a divergence source, drawn with additive blending: s = s + amount * source, 1 / s.
// reads: 1
uniform sampler2D u_source;
uniform float u_amount;
in vec2 v_uv;
layout(location = 0) out float out_source;

void main() {
    out_source = u_amount * texture(u_source, v_uv).r;
}
