// Trace: for every cell centre, how far back the fluid there came from in one step: d = x_d - x, in cells.
// u_velocity: MAC faces, lengths / s; u_dt_over_h: dt / h. Second-order backtrace.
// With DEPART a second output, what is to be advected from there: u_velocity less u_carried, at this cell's faces and, in
// BA, at those of the cell to the right, so that two of the reads of advect.frag are one.
// reads: 13
#include "lib/mac.glsl"
uniform sampler2D u_velocity;
uniform float u_dt_over_h;
layout(location = 0) out vec2 out_displacement;
#ifdef DEPART
uniform sampler2D u_carried;
layout(location = 1) out vec4 out_departing;
#endif

void main() {
    vec2 p = gl_FragCoord.xy;
#ifdef DEPART
    vec2 size = vec2(textureSize(u_velocity, 0)), texel = 1.0 / size, here = p * texel, right = vec2(here.x + texel.x, here.y);
    vec2 own = texture(u_velocity, here).rg, beside = texture(u_velocity, right).rg;
    out_departing = vec4(own - texture(u_carried, here).rg, beside - texture(u_carried, right).rg);
    vec2 centre = mac_centre(own, vec2(beside.x, texture(u_velocity, vec2(here.x, here.y + texel.y)).g), p, size);
#else
    vec2 centre = mac_centre(u_velocity, p);
#endif
    out_displacement = mac_backtrace(u_velocity, p, centre, u_dt_over_h) - p;
}
