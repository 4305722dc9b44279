// Obstruct: the obstruction factor, the part that a brush may do, into a texel for each image: less the more of it lies on cells
// that are solid or thicker than the fluid at its tip, for all of it alike. Were it less beside them only, what the brush
// moves would flow back there through a single cell, many times faster than the brush, and tear the map.
// u_motion: from probe; u_viscosity: cells, lengths^2 / s; u_solid: cells.
// reads: 193
#include "lib/brush.glsl"
#include "lib/images.glsl"
#include "lib/crowding.glsl"
uniform sampler2D u_motion;
uniform sampler2D u_viscosity;
uniform sampler2D u_solid;
uniform vec2 u_spacing;
layout(location = 0) out float out_factor;

void main() {
    ivec2 image = ivec2(gl_FragCoord.xy);
    float viscosity = texelFetch(u_motion, image, 0).w;
    out_factor = uncrowded(crowding(u_viscosity, u_solid, u_segments[image.x].zw, u_radius, viscosity, u_spacing));
}
