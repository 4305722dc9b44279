// Near: how near a place is to what is frozen: 1 in it and within u_reach texels of it, falling smoothly to 0 a cell away from
// there (Euclidean distance). Drawn along x (ALONG_X: the distance in cells, at most 1), then along y.
// u_frozen: the mask, over the whole picture, or what was drawn along x; u_offset: the texel of the accumulated map, or of
// u_frozen, of the first fragment; u_size: texels of the accumulated map; u_cell: texels of it along a cell.
// reads: 20
uniform sampler2D u_frozen;
uniform vec2 u_offset;
uniform vec2 u_size;
uniform float u_cell;
uniform float u_reach;
layout(location = 0) out float out_near;

void main() {
    vec2 texel = gl_FragCoord.xy + u_offset;
    float least = 1.0;
    for (float n = 0.0; n <= u_cell + u_reach; ++n) {
        float along = max(n - u_reach, 0.0) / u_cell;
        if (along >= least) break;
#ifdef ALONG_X
        vec2 before = (texel - vec2(n, 0.0)) / u_size, after = (texel + vec2(n, 0.0)) / u_size;
        if (max(texture(u_frozen, before).r, texture(u_frozen, after).r) > 0.5) least = min(least, along);
#else
        ivec2 here = ivec2(texel), last = textureSize(u_frozen, 0) - 1;
        float before = texelFetch(u_frozen, clamp(here - ivec2(0, n), ivec2(0), last), 0).r;
        float after = texelFetch(u_frozen, clamp(here + ivec2(0, n), ivec2(0), last), 0).r;
        least = min(least, length(vec2(min(before, after), along)));
#endif
    }
#ifdef ALONG_X
    out_near = least;
#else
    out_near = 1.0 - smoothstep(0.0, 1.0, least);
#endif
}
