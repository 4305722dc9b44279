// Prepare: the picture as it is best interpolated: colour times alpha, in linear light where LINEAR_LIGHT is defined.
// u_picture: straight alpha, or PREMULTIPLIED is defined; 0-1; its first u_count pixels are of the picture. With PACKED
// defined the picture is opaque, and a texel holds the pixel to its left and its own as two 16-bit numbers, 0-65535, of a
// word for each colour, which halves the reads of those who want neighbours; there is one texel more in x, and the edge is
// repeated.
// reads: 1
#include "lib/srgb.glsl"
uniform sampler2D u_picture;

vec4 prepared(ivec2 pixel) {
    vec4 color = texelFetch(u_picture, pixel, 0);
    float weight = color.a;
#ifdef PREMULTIPLIED
    weight = color.a > 0.0 ? color.a : 1.0;  // colour without alpha is light of its own
    color.rgb /= weight;
#endif
#ifdef LINEAR_LIGHT
    color.rgb = srgb_to_linear(color.rgb);
#endif
    return vec4(color.rgb * weight, color.a);
}

#ifdef PACKED
uniform vec2 u_count;
layout(location = 0) out uvec4 out_colors;

uvec4 codes(int x, int y) { return uvec4(ivec4(prepared(ivec2(clamp(x, 0, int(u_count.x) - 1), y)) * 65535.0 + 0.5)); }

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    out_colors = codes(pixel.x - 1, pixel.y) | codes(pixel.x, pixel.y) << 16u;
}
#else
layout(location = 0) out vec4 out_color;

void main() { out_color = prepared(ivec2(gl_FragCoord.xy)); }
#endif
