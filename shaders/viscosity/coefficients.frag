// Coefficients: K of the finest level and the inverse diagonal of A, as operator.glsl reads them.
// u_viscosity: of the cells, lengths^2 / s, of which what is above u_most counts as that; u_solid: 1 in solid ones;
// u_scale: dt / (hx hy), s / length^2.
// mu at a node is the harmonic mean of the fluid cells that meet there. A wall node's shear is nil at free-slip walls; at
// no-slip ones a face beyond it stands still at the node, half a cell away, which doubles K; at a convex corner the
// resting face is a whole cell away, and K stays.
// reads: 32
#include "viscosity/sides.glsl"
uniform sampler2D u_viscosity;
uniform sampler2D u_solid;
uniform float u_scale;
uniform float u_most;
uniform vec2 u_shear; // (s_y, s_x)
layout(location = 0) out vec4 out_cells;
layout(location = 1) out vec4 out_nodes;
layout(location = 2) out vec4 out_inverse_u;
layout(location = 3) out vec4 out_inverse_v;
layout(location = 4) out vec4 out_open;

const float LEAST = 1e-20; // so that a cell of no viscosity is still told from no fluid

// dt mu / (hx hy) of a cell, 0 where there is no fluid.
float kappa(ivec2 cell) {
    ivec2 last = textureSize(u_viscosity, 0) - 1, at = clamp(cell, ivec2(0), last);
    if (cell != at || texelFetch(u_solid, at, 0).r == 1.0) return 0.0;
    return max(u_scale * min(texelFetch(u_viscosity, at, 0).r, u_most), LEAST);
}

// Of the node in a column and row where four cells meet: upper left, upper right, lower left, lower right.
float node(vec4 k, ivec2 place) {
    vec4 wet = vec4(greaterThan(k, vec4(0.0)));
    float meeting = dot(wet, vec4(1.0)), moving = (wet.x + wet.w) * (wet.y + wet.z); // faces
    float mean = meeting / max(dot(wet / max(k, LEAST), vec4(1.0)), 1e-30);
    if (sticks(vec4(place.x), vec4(place.y)).x > 0.0) return moving < 2.0 ? 2.0 * mean : mean;
    return moving == 4.0 ? mean : 0.0;
}

void main() {
    ivec2 first = 2 * ivec2(gl_FragCoord.xy) - 3;
    float k[16], n[9]; // cells around, and the nodes between them, row by row
    for (int q = 0; q < 16; ++q) k[q] = kappa(first + ivec2(q % 4, q / 4));
    for (int q = 0; q < 9; ++q) {
        int at = q + q / 3;
        n[q] = node(vec4(k[at], k[at + 1], k[at + 4], k[at + 5]), first + 1 + ivec2(q % 3, q / 3));
    }
    vec4 here = vec4(k[5], k[6], k[9], k[10]), left = vec4(k[4], k[5], k[8], k[9]), above = vec4(k[1], k[2], k[5], k[6]);
    vec4 open_u = vec4(greaterThan(min(here, left), vec4(0.0))), open_v = vec4(greaterThan(min(here, above), vec4(0.0)));
    vec4 nodes = vec4(n[0], n[1], n[3], n[4]);
    vec2 s = u_shear * u_shear;
    // Signs tell which faces are open where these are read anyway; a node that resists nothing has one too.
    out_cells = (2.0 * open_u - 1.0) * 2.0 * s.y * here;
    out_nodes = (2.0 * open_v - 1.0) * max(nodes, 1e-30);
    out_inverse_u = open_u / (1.0 + 2.0 * s.y * (here + left) + s.x * (nodes + vec4(n[3], n[4], n[6], n[7])));
    out_inverse_v = open_v / (1.0 + 2.0 * s.x * (here + above) + s.y * (nodes + vec4(n[1], n[2], n[4], n[5])));
    out_open = (open_u + 2.0 * open_v) / 255.0;
}
