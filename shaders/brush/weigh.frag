// Weigh: how much of each cell is under the brush, as far as it is open.
// u_solid: cells.
// vertices: lib/images.vert
// reads: 1
#include "lib/brush.glsl"
uniform sampler2D u_solid;
uniform vec2 u_spacing;
flat in vec4 v_segment;
layout(location = 0) out float out_weight;

void main() {
    out_weight = (1.0 - texelFetch(u_solid, ivec2(gl_FragCoord.xy), 0).r) * brush_weight(v_segment, gl_FragCoord.xy * u_spacing);
}
