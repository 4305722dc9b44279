// Handle stream: the stream function of one handle's push at the nodes, drawn with additive blending:
//   psi = w(r / radius) (F x r),   w(q) = (1 - q)^5 (1 + 5 q)   up to 1, 0 beyond
// Its curl is F at the middle. The kernel F -> curl psi is minus the curl of the curl of Wendland's phi_3,2 =
// (1 - q)^6 (35 q^2 + 18 q + 3), so positive definite: handles at different places can be led each as it wants
// (Narcowich and Ward 1994).
// u_place, u_radius: lengths from the grid's corner; u_force: F, lengths / s; u_spacing: sides of a cell, lengths;
// u_tip_viscosity: lengths^2 / s, if ATTENUATED, see lib/attenuation.glsl.
// reads: 0, and 4 when ATTENUATED
#include "lib/attenuation.glsl"
uniform vec2 u_place;
uniform float u_radius;
uniform vec2 u_force;
uniform vec2 u_spacing;
uniform float u_tip_viscosity;
layout(location = 0) out float out_stream;

void main() {
    vec2 node = floor(gl_FragCoord.xy), r = node * u_spacing - u_place;
    float q = min(length(r) / u_radius, 1.0), far = 1.0 - q, far2 = far * far;
    out_stream = far2 * far2 * far * (1.0 + 5.0 * q) * (u_force.x * r.y - u_force.y * r.x) * attenuation(node, u_tip_viscosity);
}
