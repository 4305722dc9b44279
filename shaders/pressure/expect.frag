// The whole pressure, and the one to expect next, by its trend.
// in:  u_base, u_change   the two parts of the pressure;  u_before   the one before;  u_trend   1, or 0 for none
// out: last      base + change
//      expected  last + trend (last - before), all of them pressure / h at blocks, lengths / s
// reads: 3
uniform sampler2D u_base;
uniform sampler2D u_change;
uniform sampler2D u_before;
uniform float u_trend;

in vec2 v_uv;
layout(location = 0) out vec4 out_last;
layout(location = 1) out vec4 out_expected;

void main() {
    out_last = texture(u_base, v_uv) + texture(u_change, v_uv);
    out_expected = out_last + u_trend * (out_last - texture(u_before, v_uv));
}
