// Average what is frozen: the part of each cell that is covered by it; 0 only if nothing is, 1 only if all is.
// u_frozen: on a canvas, frozen from 1/2.
// reads: 64
#include "lib/texels.glsl"
uniform sampler2D u_frozen;
layout(location = 0) out float out_covered;

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
    out_covered = sum > 0.0 ? clamp(sum / area, 1.0 / 255.0, sum < area ? 254.0 / 255.0 : 1.0) : 0.0;
}
