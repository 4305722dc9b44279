// Coarsen: means over square blocks of a mask's texels, the first of them at u_corner, of 8 x 8 places in each.
// u_mask: any texels; u_side: texels along a block, of which those beyond the mask do not count.
// reads: 64
uniform sampler2D u_mask;
uniform vec2 u_corner;
uniform float u_side;
layout(location = 0) out float out_mean;

void main() {
    vec2 low = u_corner + floor(gl_FragCoord.xy) * u_side, end = vec2(textureSize(u_mask, 0));
    float sum = 0.0, count = 0.0;
    for (float y = 0.5; y < 8.0; ++y)
        for (float x = 0.5; x < 8.0; ++x) {
            vec2 place = floor(low + vec2(x, y) * u_side / 8.0);
            if (any(greaterThanEqual(place, end))) continue;
            sum += texelFetch(u_mask, ivec2(place), 0).r;
            count += 1.0;
        }
    out_mean = sum / count;
}
