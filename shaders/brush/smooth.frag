// Smooth a mask under the brush: towards the means around, interpolated, and in alpha by which part; with blending.
// u_means: from coarsen, linear filtering; u_corner, u_side: of its blocks, texels of the mask; u_strength: 0-1.
// vertices: lib/images.vert
// reads: 1
#include "lib/brush.glsl"
uniform sampler2D u_means;
uniform vec2 u_corner;
uniform float u_side;
uniform float u_strength;
uniform vec2 u_spacing;
flat in vec4 v_segment;
layout(location = 0) out vec4 out_mask;

void main() {
    float mean = texture(u_means, (gl_FragCoord.xy - u_corner) / (u_side * vec2(textureSize(u_means, 0)))).r;
    out_mask = vec4(vec3(mean), u_strength * brush_weight(v_segment, gl_FragCoord.xy * u_spacing));
}
