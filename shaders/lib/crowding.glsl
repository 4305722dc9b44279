// Crowding: the part, 0-1, of a brush of `radius` around `middle` (lengths from the grid's corner) that lies on cells that
// are solid or thicker than the fluid at its tip; on what is a little thicker, a little.
// viscosity: cells, lengths^2 / s; solid: cells; spacing: sides of a cell, lengths.
// 192 reads.
#include "lib/between_cells.glsl"
const int CROWDING_RAYS = 8, CROWDING_ALONG = 3;

float crowding(sampler2D viscosity, sampler2D solid, vec2 middle, float radius, float tip_viscosity, vec2 spacing) {
    vec2 size = vec2(textureSize(solid, 0));
    float thin = max(tip_viscosity, 1e-9), sum = 0.0;
    for (int k = 0; k < CROWDING_RAYS; ++k) {
        float angle = 6.2831853 * float(k) / float(CROWDING_RAYS);
        vec2 ray = vec2(cos(angle), sin(angle)) * radius / float(CROWDING_ALONG);
        for (int j = 1; j <= CROWDING_ALONG; ++j) {
            Around place = around((middle + ray * float(j)) / spacing, size);
            vec4 thicker = 1.0 - thin / max(cells(viscosity, place.uv), thin);
            vec4 spared = max(step(0.5, cells(solid, place.uv)), thicker);
            vec2 rows = mix(spared.xz, spared.yw, place.part.x);
            sum += mix(rows.x, rows.y, place.part.y);
        }
    }
    return sum / float(CROWDING_RAYS * CROWDING_ALONG);
}

// The part that such a brush may do: nothing from a quarter on.
float uncrowded(float crowding) { return 1.0 - smoothstep(0.0, 0.25, crowding); }
