// Average what is frozen: 1 in cells of which at least u_enough is covered by it (equation B2), else 0.
// u_frozen: on a canvas, frozen from 1/2.
// reads: 64
#include "lib/texels.glsl"
uniform sampler2D u_frozen;
uniform float u_enough;
layout(location = 0) out float out_solid;

void main() {
    vec2 corner;
    Texels texels = texels_under(floor(gl_FragCoord.xy), vec2(textureSize(u_frozen, 0)));
    float sum = 0.0, area = 0.0;
    for (corner.y = texels.first.y; corner.y < texels.high.y; corner.y += texels.block.y)
        for (corner.x = texels.first.x; corner.x < texels.high.x; corner.x += texels.block.x) {
            float part = block_area(texels, corner);
            sum += part * step(0.5, texelFetch(u_frozen, block_texel(texels, corner), 0).r);
            area += part;
        }
    out_solid = step(u_enough, sum / area);
}
