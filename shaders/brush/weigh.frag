// Weigh: how much of each cell is under the brush, as far as it is open.
// u_solid: cells.
// reads: 1
#include "lib/brush.glsl"
uniform sampler2D u_solid;
uniform vec2 u_spacing;
in vec2 v_uv;
layout(location = 0) out float out_weight;

void main() {
    out_weight = (1.0 - texture(u_solid, v_uv).r) * brush_weight(gl_FragCoord.xy * u_spacing);
}
