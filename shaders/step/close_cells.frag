// Close cells: how far a cell is closed to the flow, by the distance d of its middle from what is frozen, in cells: 1 (solid)
// where d <= u_solid, less and less over one cell more, then 0.
// u_frozen: on a canvas, frozen from 1/2; u_covered: cells, the part of each that is frozen; u_reach: cells, how far off one
// may be that closes another.
// reads: 5000
#include "lib/texels.glsl"
uniform sampler2D u_frozen;
uniform sampler2D u_covered;
uniform float u_solid;
uniform float u_reach;
layout(location = 0) out float out_solid;

// Of the middle of a cell from a box, cells^2.
float squared_distance(vec2 middle, vec2 low, vec2 high) {
    vec2 far = max(max(low - middle, middle - high), 0.0);
    return dot(far, far);
}

void main() {
    vec2 cell = floor(gl_FragCoord.xy), middle = cell + 0.5, canvas = vec2(textureSize(u_frozen, 0));
    ivec2 cells = textureSize(u_covered, 0);
    float far = 1e3;
    vec2 off;
    for (off.y = -u_reach; off.y <= u_reach; ++off.y)
        for (off.x = -u_reach; off.x <= u_reach; ++off.x) {
            vec2 other = cell + off;
            ivec2 at = ivec2(other);
            if (at != clamp(at, ivec2(0), cells - 1)) continue;
            float covered = texelFetch(u_covered, at, 0).r;
            if (covered == 0.0 || squared_distance(middle, other, other + 1.0) >= far) continue;
            if (covered == 1.0) {
                far = min(far, squared_distance(middle, other, other + 1.0));
                continue;
            }
            Texels texels = texels_under(other, canvas);
            vec2 corner, cells_a_texel = 1.0 / (u_cell * canvas);
            for (corner.y = texels.first.y; corner.y < texels.high.y; corner.y += texels.block.y)
                for (corner.x = texels.first.x; corner.x < texels.high.x; corner.x += texels.block.x)
                    if (texelFetch(u_frozen, block_texel(texels, corner), 0).r >= 0.5) {
                        vec2 low = max(corner, texels.low) - texels.low, high = min(corner + texels.block, texels.high) - texels.low;
                        far = min(far, squared_distance(middle, other + low * cells_a_texel, other + high * cells_a_texel));
                    }
        }
    out_solid = clamp(u_solid + 1.0 - sqrt(far), 0.0, 1.0);
}
