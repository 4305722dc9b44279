// Freeze or thaw: the value that a mask goes towards, and in alpha by which part, drawn with blending: as far as the
// brush's radius alike, whatever its hardness, since a place can only be frozen or not. At the edge a texel goes by the
// part that is covered.
// u_towards: 1 freezes, 0 thaws; u_amount: 0-1.
// vertices: lib/images.vert
// reads: 0
#include "lib/brush.glsl"
uniform float u_towards;
uniform float u_amount;
uniform vec2 u_spacing;
flat in vec4 v_segment;
layout(location = 0) out vec4 out_frozen;

void main() {
    vec2 x = gl_FragCoord.xy * u_spacing;
    float inside = (u_radius - distance(x, brush_nearest(v_segment, x))) / max(u_spacing.x, u_spacing.y);
    out_frozen = vec4(vec3(u_towards), u_amount * clamp(inside + 0.5, 0.0, 1.0));
}
