// Coarsen: K of the nodes of a single column or row of cells on the next coarser level, S' K S / 2, S linear along it alone.
// Nothing moves across it, and the shears on its two walls are those of the finer level.
// Below all is said of a column. A coupling is the sum over the pairs of fine nodes around its two coarse ones.
// reads: 78
#include "viscosity/coarse_nodes.glsl"

// K of the fine nodes so many places on, on the walls that the texel's columns are.
vec4 along(int place) {
    if (u_alone.y > 1.0) return vec4(at(0, place).xy, at(-1, place).zw);
    vec4 one = at(place, 0), other = at(place, -1);
    return vec4(one.x, other.y, one.z, other.w);
}

// What is kept with the nodes of the first wall, for those of both; and of the second. Of a row, all is kept with the first.
vec4 of_first(vec4 k) { return u_alone.y > 1.0 ? k : k.xxzz; }
vec4 of_second(vec4 k) { return u_alone.y > 1.0 ? k : k.yyww; }

void main() {
    bool is_row = u_alone.y > 1.0;
    int on = is_row ? -1 : 1; // whether n4, to the lower left, is one back along it, or on
    read(u_node0);
    vec4 n0 = along(0) + 0.25 * (along(-1) + along(1)), n_along = 0.25 * along(1);
    vec4 n_across = vec4(0.0), n3 = vec4(0.0), n4 = vec4(0.0);
#ifndef FINE_IS_FINEST
    if (is_row) read(u_node1);
    else read(u_node2);
    n0 += along(-1) + along(0);
    n_along += 0.5 * (along(0) + along(1));
    if (is_row) read(u_node2);
    else read(u_node1);
    n_across = along(0) + 0.25 * (along(-1) + along(1));
    n3 = 0.25 * along(1);
    n4 = 0.25 * of_first(along(on));
    read(u_node3);
    n_across += 0.5 * (along(-1) + along(0));
    n3 += 0.5 * (along(0) + along(1));
    read(u_node4);
    n_across += 0.5 * of_second(along(-on) + along(0));
    n4 += 0.5 * (along(0) + along(on));
#endif
    keep(n0, is_row ? n_along : n_across, is_row ? n_across : n_along, n3, n4, 0.5);
}
