// Coarsen: means over square blocks of a mask's texels, the first of them at u_corner.
// u_mask: any texels; u_side: texels along a block, of which those beyond the mask do not count.
// reads: 64
uniform sampler2D u_mask;
uniform vec2 u_corner;
uniform float u_side;
layout(location = 0) out float out_mean;

void main() {
    ivec2 low = ivec2(u_corner + floor(gl_FragCoord.xy) * u_side);
    ivec2 high = min(low + int(u_side), textureSize(u_mask, 0));
    float sum = 0.0;
    for (int y = low.y; y < high.y; ++y)
        for (int x = low.x; x < high.x; ++x) sum += texelFetch(u_mask, ivec2(x, y), 0).r;
    ivec2 count = high - low;
    out_mean = sum / float(count.x * count.y);
}
