// Stress: K B f on a coarse level, where K couples a strain with its neighbours of the same kind (equation V4).
// u_u, u_v: faces f, packed as in operator.glsl; u_xx0, u_xx1, u_xx2: couplings of a cell's e_xx with itself and with the
// cells one and two rows below; u_yy0 ...: of e_yy, with the cells to the right; u_node0 ... u_node4: of a node's shear
// with itself, the right, the lower, the lower right and the lower left node.
// reads: 47
uniform vec2 u_shear;
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_xx0;
uniform sampler2D u_xx1;
uniform sampler2D u_xx2;
uniform sampler2D u_yy0;
uniform sampler2D u_yy1;
uniform sampler2D u_yy2;
uniform sampler2D u_node0;
uniform sampler2D u_node1;
uniform sampler2D u_node2;
uniform sampler2D u_node3;
uniform sampler2D u_node4;
in vec2 v_uv;
layout(location = 0) out vec4 out_xx;
layout(location = 1) out vec4 out_yy;
layout(location = 2) out vec4 out_xy;

// Values of the texel `f` one row (or column) of cells on, and back, given the texel that follows or is before it.
vec4 down(vec4 f, vec4 next) { return vec4(f.zw, next.xy); }
vec4 up(vec4 f, vec4 before) { return vec4(before.zw, f.xy); }
vec4 right(vec4 f, vec4 next) { return vec4(f.y, next.x, f.w, next.z); }
vec4 left(vec4 f, vec4 before) { return vec4(before.y, f.x, before.w, f.z); }

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_u, 0)), x = vec2(texel.x, 0.0), y = vec2(0.0, texel.y);
    vec4 u[9], v[9]; // texels around, row by row, the own one in the middle
    for (int q = 0; q < 9; ++q) {
        vec2 at = v_uv + float(q % 3 - 1) * x + float(q / 3 - 1) * y;
        u[q] = texture(u_u, at);
        v[q] = texture(u_v, at);
    }

    vec4 a = right(u[1], u[2]) - u[1], b = right(u[4], u[5]) - u[4], c = right(u[7], u[8]) - u[7];
    vec4 k1 = texture(u_xx1, v_uv);
    out_xx = texture(u_xx0, v_uv) * b + k1 * down(b, c) + up(k1, texture(u_xx1, v_uv - y)) * up(b, a)
           + texture(u_xx2, v_uv) * c + texture(u_xx2, v_uv - y) * a;

    a = down(v[3], v[6]) - v[3];
    b = down(v[4], v[7]) - v[4];
    c = down(v[5], v[8]) - v[5];
    k1 = texture(u_yy1, v_uv);
    out_yy = texture(u_yy0, v_uv) * b + k1 * right(b, c) + left(k1, texture(u_yy1, v_uv - x)) * left(b, a)
           + texture(u_yy2, v_uv) * c + texture(u_yy2, v_uv - x) * a;

    // Shears of the nodes around, each four texels' worth: of the own texel's nodes, and of those one place off.
    vec4 shear[9];
    for (int q = 0; q < 9; ++q) {
        vec4 above = q < 3 ? vec4(0.0) : u[q - 3], before = q % 3 == 0 ? vec4(0.0) : v[q - 1];
        shear[q] = u_shear.x * (u[q] - up(u[q], above)) + u_shear.y * (v[q] - left(v[q], before));
    }
    vec4 here = shear[4], north = up(here, shear[1]), south = down(here, shear[7]);
    vec4 west = left(here, shear[3]), east = right(here, shear[5]);
    vec4 north_row_west = up(shear[3], shear[0]), north_row_east = up(shear[5], shear[2]);
    vec4 south_row_west = down(shear[3], shear[6]), south_row_east = down(shear[5], shear[8]);
    vec4 n1 = texture(u_node1, v_uv), n2 = texture(u_node2, v_uv), n3 = texture(u_node3, v_uv), n4 = texture(u_node4, v_uv);
    vec4 n3_west = left(up(n3, texture(u_node3, v_uv - y)),
                        up(texture(u_node3, v_uv - x), texture(u_node3, v_uv - x - y)));
    vec4 n4_east = right(up(n4, texture(u_node4, v_uv - y)),
                         up(texture(u_node4, v_uv + x), texture(u_node4, v_uv + x - y)));
    out_xy = texture(u_node0, v_uv) * here + n1 * east + left(n1, texture(u_node1, v_uv - x)) * west
           + n2 * south + up(n2, texture(u_node2, v_uv - y)) * north
           + n3 * right(south, south_row_east) + n3_west * left(north, north_row_west)
           + n4 * left(south, south_row_west) + n4_east * right(north, north_row_east);
}
