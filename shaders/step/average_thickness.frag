// Average thickness: the fluid's viscosity from what the recipe sets and what is painted over it on a canvas:
//   mu = mu0 10^(mean thickness of the cell)                                                             (B2)
// (a painted cell of a fluid without viscosity starts from u_least, and none comes above u_most).
// u_base_viscosity: mu0, cells, lengths^2 / s; u_thickness: see lib/decades.glsl.
// reads: 65
#include "lib/decades.glsl"
#include "lib/texels.glsl"
uniform sampler2D u_base_viscosity;
uniform sampler2D u_thickness;
uniform float u_least;
uniform float u_most;
layout(location = 0) out float out_viscosity;

void main() {
    vec2 cell = floor(gl_FragCoord.xy), corner;
    Texels texels = texels_under(cell, vec2(textureSize(u_thickness, 0)));
    float sum = 0.0, area = 0.0;
    bool painted = false;
    for (corner.y = texels.first.y; corner.y < texels.high.y; corner.y += texels.block.y)
        for (corner.x = texels.first.x; corner.x < texels.high.x; corner.x += texels.block.x) {
            float thickness = decades(texelFetch(u_thickness, block_texel(texels, corner), 0).r);
            float part = block_area(texels, corner);
            sum += part * thickness;
            area += part;
            painted = painted || thickness != 0.0;
        }
    float base = texelFetch(u_base_viscosity, ivec2(cell), 0).r;
    out_viscosity = painted ? min(max(base, u_least) * pow(10.0, sum / area), u_most) : base;
}
