// Hold: where the map is held about what is frozen: 1 within u_inner texels of it, 2/3 within u_reach, else 0. Drawn along x
// (ALONG_X), then along y.
// u_frozen: the mask, over the whole picture, frozen from 1/2 on, or what was drawn along x; u_size: texels of the map over
// it; u_offset: the texel of the first fragment.
// reads: 8
uniform sampler2D u_frozen;
uniform vec2 u_offset;
uniform vec2 u_size;
uniform float u_inner;
uniform float u_reach;
layout(location = 0) out float out_held;

void main() {
    vec2 texel = gl_FragCoord.xy + u_offset;
    out_held = 0.0;
    for (float n = 0.0; n <= u_reach; ++n) {
        float most = n > u_inner ? 2.0 / 3.0 : 1.0;
#ifdef ALONG_X
        vec2 before = (texel - vec2(n, 0.0)) / u_size, after = (texel + vec2(n, 0.0)) / u_size;
        out_held = max(out_held, most * step(0.5, max(texture(u_frozen, before).r, texture(u_frozen, after).r)));
#else
        vec2 before = (texel - vec2(0.0, n)) / u_size, after = (texel + vec2(0.0, n)) / u_size;
        out_held = max(out_held, min(most, max(texture(u_frozen, before).r, texture(u_frozen, after).r)));
#endif
        if (out_held == most) break;
    }
}
