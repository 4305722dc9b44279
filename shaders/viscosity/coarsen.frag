// Coarsen: K of the next coarser grid from the finer one, see cells.glsl.
// With the prolongation linear both ways a fine strain is half a mean of coarse ones, so the energy K strain^2 is at most
// that of the coarse strains with each fine K shared out by the same weights: the coarse matrix is never softer than the
// Galerkin product, and a cycle cannot overshoot at any contrast (Jensen's inequality). Means are over fluid only.
// A coarse face is open if all the fine faces it moves are, so a correction never pushes through a wall.
// reads: 16
#include "viscosity/cells.glsl"
layout(location = 0) out vec4 out_cell;

float mean(vec2 sum) { return sum.y > 0.0 ? sum.x / sum.y : 0.0; }

void main() {
    ivec2 corner = 2 * ivec2(gl_FragCoord.xy);
    const vec4 outer = vec4(0.25, 0.75, 0.75, 0.25), inner = vec4(0.0, 1.0, 1.0, 0.0), node = vec4(0.5, 1.0, 0.5, 0.0);
    vec2 x = vec2(0.0), y = vec2(0.0), n = vec2(0.0);
    bool open_u = true, open_v = true;
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
            vec4 fine = cell(corner + ivec2(i - 1, j - 1));
            if (fine.r > 0.0) {
                x += inner[i] * outer[j] * vec2(fine.r, 1.0);
                y += outer[i] * inner[j] * vec2(fine.g, 1.0);
            }
            if (fine.b > 0.0) n += node[i] * node[j] * vec2(fine.b, 1.0);
            if (i < 3 && (j == 1 || j == 2)) open_u = open_u && left_open(fine);
            if (j < 3 && (i == 1 || i == 2)) open_v = open_v && upper_open(fine);
        }
    // A cell twice as wide: h^2 is four times as large.
    out_cell = vec4(0.25 * vec3(mean(x), mean(y), mean(n)), float(open_u) + 2.0 * float(open_v));
}
