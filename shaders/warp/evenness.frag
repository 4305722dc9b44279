// Evenness: how far the four cells around a texel of a map agree on det J there, each by its own cubic (lib/displacement.glsl):
// of a block, the largest of -least / greatest, -1 where all agree and 1 where all are folded. A smooth map has one det J.
// u_displacement (D): longer sides, and u_images of it; u_spacing: distances of the texels, longer sides; u_side: texels along
// a block. u_steepness: the largest |grad D|^2 of each block; where that is u_flat^2 at most it counts as even.
// Texels whose cubic would go on beyond the edge, as it has no images there, are left out, and with HELD those next to what
// is held and in it (u_held, see lib/warp.glsl): on that border the map has a bend.
// reads: 576
uniform sampler2D u_displacement;
uniform sampler2D u_steepness;
uniform vec2 u_spacing;
uniform vec4 u_images;
uniform float u_side;
uniform float u_flat;
#ifdef HELD
uniform sampler2D u_held;
#endif
layout(location = 0) out float out_uneven;

vec2 texel_at(vec2 at, vec2 size) {
    vec2 place = size - abs(size - abs(at));
    vec2 value = texture(u_displacement, place / size).rg;
    if (place.x != at.x) value *= vec2(-1.0, at.x < 0.0 ? u_images.x : u_images.y);
    if (place.y != at.y) value *= vec2(at.y < 0.0 ? u_images.z : u_images.w, -1.0);
    return value;
}

// The slopes of the cubic after a texel and of that before it, given the texel in the middle of five.
void sides(vec2 two_before, vec2 before, vec2 here, vec2 after, vec2 two_after, float spacing, out vec2 slopes[2]) {
    slopes[0] = (6.0 * after - 3.0 * here - 2.0 * before - two_after) / (6.0 * spacing);
    slopes[1] = (two_before - 6.0 * before + 3.0 * here + 2.0 * after) / (6.0 * spacing);
}

float uneven(vec2 at, vec2 size) {
    vec2 here = texel_at(at, size), across[2], down[2];
    sides(texel_at(at - vec2(2.0, 0.0), size), texel_at(at - vec2(1.0, 0.0), size), here,
          texel_at(at + vec2(1.0, 0.0), size), texel_at(at + vec2(2.0, 0.0), size), u_spacing.x, across);
    sides(texel_at(at - vec2(0.0, 2.0), size), texel_at(at - vec2(0.0, 1.0), size), here,
          texel_at(at + vec2(0.0, 1.0), size), texel_at(at + vec2(0.0, 2.0), size), u_spacing.y, down);
    vec4 det;
    for (int k = 0; k < 4; ++k) {
        vec2 x = across[k % 2], y = down[k / 2];
        det[k] = (1.0 + x.x) * (1.0 + y.y) - x.y * y.x;
    }
    float least = min(min(det.x, det.y), min(det.z, det.w)), greatest = max(max(det.x, det.y), max(det.z, det.w));
    return greatest > 0.0 ? -least / greatest : 1.0;
}

void main() {
    vec2 size = vec2(textureSize(u_displacement, 0)), block = floor(gl_FragCoord.xy);
    out_uneven = -1.0;
    // The last block may have no corner of its own.
    if (texelFetch(u_steepness, min(ivec2(block), textureSize(u_steepness, 0) - 1), 0).r <= u_flat * u_flat) return;
    vec4 inner = 2.0 * (1.0 - abs(u_images));
    vec2 first = max(u_side * block, inner.xz), end = min(u_side * (block + 1.0), size - inner.yw);
    for (float y = first.y + 0.5; y < end.y; ++y)
        for (float x = first.x + 0.5; x < end.x; ++x) {
#ifdef HELD
            if (texture(u_held, vec2(x, y) / size).r > 125.5 / 255.0) continue;
#endif
            out_uneven = max(out_uneven, uneven(vec2(x, y), size));
        }
}
