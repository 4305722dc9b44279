// The gradient of the pressure, the pressure to keep, and the one to expect next, by its trend.
// The pressure is given as two parts, which are added only after taking differences: that keeps the digits of the smaller.
// The rounding of the velocities is noise from cell to cell in every step, which a trend of two steps would more than
// double. So where there is a trend, the change is smoothed a little before it is kept, and more before it makes the trend.
// in:  u_expected, u_change   the two parts of the pressure;  u_before   the one kept before;  u_trend   1, or 0 for none
//      links of lib/block.glsl
// out: across, down   p - p_left and p - p_up at the blocks' four cells, lengths / s
//      last           expected + change
//      next           last + trend (expected + change - before), what to expect next, at blocks, lengths / s
// reads: 13
#include "lib/block.glsl"

uniform sampler2D u_expected;
uniform sampler2D u_change;
uniform sampler2D u_before;
uniform float u_trend;

// Fractions of A p that are added to the change: 1/8 would remove a checkerboard. The kept pressure loses half of it, the
// trend nearly all; not all, as a checkerboard that is in the expected pressure already would then never fade.
const float KEPT = 0.0625, TREND = 0.12;

in vec2 v_uv;
layout(location = 0) out vec4 out_across;
layout(location = 1) out vec4 out_down;
layout(location = 2) out vec4 out_last;
layout(location = 3) out vec4 out_next;

void differences(sampler2D p, vec4 here, out vec4 across, out vec4 down) {
    across = here - vec4(textureOffset(p, v_uv, ivec2(-1, 0)).yw, here.xz).xzyw;
    down = here - vec4(textureOffset(p, v_uv, ivec2(0, -1)).zw, here.xy);
}

void main() {
    vec4 expected = texture(u_expected, v_uv), change = texture(u_change, v_uv), across, down;
    differences(u_expected, expected, out_across, out_down);
    differences(u_change, change, across, down);
    out_across += across;
    out_down += down;
    vec4 bend = u_trend * laplacian(u_change, v_uv, change, links_of(floor(gl_FragCoord.xy), v_uv));
    out_last = expected + change + KEPT * bend;
    out_next = out_last + u_trend * (expected - texture(u_before, v_uv) + change + TREND * bend);
}
