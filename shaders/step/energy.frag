// Energy: what a step has left of the energy that departed, summed over a block of 2 x 2 cells (equation S5).
// u_u, u_v: w3, packed as viscosity/operator.glsl has it; u_departing: w1, MAC faces, all lengths / s.
// squares: |w3|^2, |w1|^2.
// reads: 6
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_departing;
layout(location = 0) out vec2 out_squares;

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_departing, 0)), a = (2.0 * floor(gl_FragCoord.xy) + 0.5) * texel, b = a + texel;
    vec2 at = (floor(gl_FragCoord.xy) + 1.5) / vec2(textureSize(u_u, 0));
    vec4 u = texture(u_u, at), v = texture(u_v, at);
    // Beyond the last column or row of an odd grid there are no cells.
    vec2 in_grid = vec2(lessThan(b, vec2(1.0)));
    vec2 p = texture(u_departing, a).rg, q = in_grid.x * texture(u_departing, vec2(b.x, a.y)).rg;
    vec2 r = in_grid.y * texture(u_departing, vec2(a.x, b.y)).rg, s = in_grid.x * in_grid.y * texture(u_departing, b).rg;
    out_squares = vec2(dot(u, u) + dot(v, v), dot(p, p) + dot(q, q) + dot(r, r) + dot(s, s));
}
