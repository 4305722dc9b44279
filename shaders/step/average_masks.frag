// Average masks: the fluid's viscosity and solid cells from what the recipe sets and what is painted on a canvas of its
// own size, by the part of each cell that every texel covers:
//   mu = mu0 10^(mean thickness), solid where at least u_enough of the cell is frozen
// (a painted cell of a fluid without viscosity starts from u_least, and none comes above u_most).
// u_base_viscosity: cells, lengths^2 / s; u_thickness: see lib/decades.glsl; u_frozen: frozen from 1/2; u_origin, u_cell:
// corner of the grid and sides of a cell, in 0-1 of the picture.
// reads: 129
#include "lib/decades.glsl"
uniform sampler2D u_base_viscosity;
uniform sampler2D u_thickness;
uniform sampler2D u_frozen;
uniform vec2 u_origin;
uniform vec2 u_cell;
uniform float u_least;
uniform float u_most;
uniform float u_enough;
layout(location = 0) out float out_viscosity;
layout(location = 1) out float out_solid;

void main() {
    vec2 low = u_origin + floor(gl_FragCoord.xy) * u_cell, high = low + u_cell;
    float viscosity = texelFetch(u_base_viscosity, ivec2(gl_FragCoord.xy), 0).r;
#ifdef THICKNESS
    {
        vec2 size = vec2(textureSize(u_thickness, 0)), a = low * size, b = min(high * size, size);
        float sum = 0.0, area = 0.0;
        bool painted = false;
        for (float y = floor(a.y); y < b.y; ++y)
            for (float x = floor(a.x); x < b.x; ++x) {
                vec2 sides = min(vec2(x, y) + 1.0, b) - max(vec2(x, y), a);
                float thickness = decades(texelFetch(u_thickness, ivec2(x, y), 0).r);
                sum += sides.x * sides.y * thickness;
                area += sides.x * sides.y;
                painted = painted || thickness != 0.0;
            }
        if (painted) viscosity = min(max(viscosity, u_least) * pow(10.0, sum / area), u_most);
    }
#endif
    out_viscosity = viscosity;
    out_solid = 0.0;
#ifdef FROZEN
    {
        vec2 size = vec2(textureSize(u_frozen, 0)), a = low * size, b = min(high * size, size);
        float sum = 0.0, area = 0.0;
        for (float y = floor(a.y); y < b.y; ++y)
            for (float x = floor(a.x); x < b.x; ++x) {
                vec2 sides = min(vec2(x, y) + 1.0, b) - max(vec2(x, y), a);
                sum += sides.x * sides.y * step(0.5, texelFetch(u_frozen, ivec2(x, y), 0).r);
                area += sides.x * sides.y;
            }
        out_solid = step(u_enough, sum / area);
    }
#endif
}
