// Obstruct: the part that a brush may do, into a single texel: less the more of it lies on cells that are frozen or thicker than
// the fluid at its tip, for all of it alike. Were it less beside them only, what the brush moves would flow back there
// through a single cell, many times faster than the brush, and tear the map.
// u_motion: from probe; u_viscosity: cells, lengths^2 / s; u_solid: cells.
// reads: 49
#include "lib/brush.glsl"
uniform sampler2D u_motion;
uniform sampler2D u_viscosity;
uniform sampler2D u_solid;
uniform vec2 u_spacing;
layout(location = 0) out float out_part;

const int RAYS = 8, ALONG = 3;
const float CROWDED = 0.25; // part of the brush on such cells from which on nothing is led

void main() {
    vec2 size = vec2(textureSize(u_solid, 0));
    float thin = max(texelFetch(u_motion, ivec2(0), 0).w, 1e-9), sum = 0.0;
    for (int k = 0; k < RAYS; ++k) {
        float angle = 6.2831853 * float(k) / float(RAYS);
        vec2 way = vec2(cos(angle), sin(angle)) * u_radius / float(ALONG);
        for (int j = 1; j <= ALONG; ++j) {
            vec2 place = (u_segment.zw + way * float(j)) / (size * u_spacing);
            float thicker = max(texture(u_viscosity, place).r / thin, 1.0);
            sum += max(step(0.5, texture(u_solid, place).r), 1.0 - 1.0 / thicker);
        }
    }
    out_part = 1.0 - smoothstep(0.0, CROWDED, sum / float(RAYS * ALONG));
}
