// Prepare: the picture as it is best interpolated: colour times alpha, in linear light where LINEAR_LIGHT is defined.
// u_picture: straight alpha, 0-1.
// reads: 1
#include "lib/srgb.glsl"
uniform sampler2D u_picture;
layout(location = 0) out vec4 out_color;

void main() {
    vec4 color = texelFetch(u_picture, ivec2(gl_FragCoord.xy), 0);
#ifdef LINEAR_LIGHT
    color.rgb = srgb_to_linear(color.rgb);
#endif
    out_color = vec4(color.rgb * color.a, color.a);
}
