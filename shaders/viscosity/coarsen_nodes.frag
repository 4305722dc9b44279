// Coarsen: K of the nodes on the next coarser level, S' K S / 16 (equation V4), S linear both ways: weights 1/2 1 1/2.
// A coupling is the sum over the pairs of fine nodes around its two coarse ones, either way round.
// reads: 78
#include "viscosity/coarse_nodes.glsl"

vec4 down(int column) { return 0.25 * (at(-1, column) + at(1, column)) + at(0, column); }
vec4 across(int row) { return 0.25 * (at(row, -1) + at(row, 1)) + at(row, 0); }
vec4 square(int row, int column) {
    return at(row, column) + at(row, column + 1) + at(row + 1, column) + at(row + 1, column + 1);
}

void main() {
    read(u_node0);
    vec4 n0 = 0.25 * (down(-1) + down(1)) + down(0), n1 = 0.25 * down(1), n2 = 0.25 * across(1);
    vec4 n3 = 0.0625 * at(1, 1), n4 = 0.0625 * at(1, -1);
#ifndef FINE_IS_FINEST
    read(u_node1);
    n0 += down(-1) + down(0);
    n1 += 0.5 * (down(0) + down(1));
    n2 += 0.25 * (at(1, -1) + at(1, 0));
    n3 += 0.125 * (at(1, 0) + at(1, 1));
    n4 += 0.125 * (at(1, -2) + at(1, -1));
    read(u_node2);
    n0 += across(-1) + across(0);
    n1 += 0.25 * (at(-1, 1) + at(0, 1));
    n2 += 0.5 * (across(0) + across(1));
    n3 += 0.125 * (at(0, 1) + at(1, 1));
    n4 += 0.125 * (at(0, -1) + at(1, -1));
    read(u_node3);
    n0 += 0.5 * square(-1, -1);
    n1 += 0.25 * square(-1, 0);
    n2 += 0.25 * square(0, -1);
    n3 += 0.25 * square(0, 0);
    read(u_node4);
    n0 += 0.5 * square(-1, 0);
    n1 += 0.25 * square(-1, 1);
    n2 += 0.25 * square(0, 0);
    n4 += 0.25 * square(0, -1);
#endif
    keep(n0, n1, n2, n3, n4, 1.0 / 16.0);
}
