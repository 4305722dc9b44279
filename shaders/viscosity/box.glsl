// Which faces are open in a box without solids, texel by texel as in operator.glsl.
#include "viscosity/sides.glsl"

vec2 own_texel() { return floor(gl_FragCoord.xy) - 1.0; }
// Columns and rows of a texel's cells.
vec4 columns(vec2 texel) { return 2.0 * texel.x + vec4(0.0, 1.0, 0.0, 1.0); }
vec4 rows(vec2 texel) { return 2.0 * texel.y + vec4(0.0, 0.0, 1.0, 1.0); }

vec4 within(vec4 place, float first, float far) { return step(first - 0.5, place) * step(place, vec4(far - 0.5)); }
vec4 open_u(vec2 texel) { return within(columns(texel), 1.0, u_box.x) * within(rows(texel), 0.0, u_box.y); }
vec4 open_v(vec2 texel) { return within(columns(texel), 0.0, u_box.x) * within(rows(texel), 1.0, u_box.y); }
