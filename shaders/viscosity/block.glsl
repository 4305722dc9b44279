// Faces and viscosities packed 2 x 2 cells a texel, (x, y, z, w) = upper left, upper right, lower left, lower right;
// u in one texture, v in another. Around the texels in use runs a ring of zeros, so that no stage asks for the edge:
// what lies beyond a wall is at rest.
// Matrix: A v = v - B^T K B v with the strains B: u_x and v_y in cells (K = 2 dt mu / h^2), u_y + v_x at nodes
// (K = dt mu_node / h^2). Pinned faces (walls, solid cells) hold exactly zero and are no unknowns.
// UNIFORM: of one viscosity in a box without solids; nothing is read, all follows from the place.
#ifdef UNIFORM
#include "viscosity/box.glsl"
uniform float u_stiffness;      // dt mu / h^2
#else
#include "viscosity/openness.glsl"
uniform sampler2D u_cells_x;    // K of u_x in the cells, negative where the cell's left face is pinned
uniform sampler2D u_cells_y;    // K of v_y in the cells (the same as cells_x on the finest grid)
uniform sampler2D u_nodes;      // K of the cells' upper left nodes, negative where the cell's upper face is pinned
uniform sampler2D u_inverse_u;  // 1 / diagonal of A for u and for v; 0 for pinned faces
uniform sampler2D u_inverse_v;
#endif

struct Faces { vec4 u, v; };
struct Stiffness { vec4 left, here_x, above, here_y, node, node_right, node_below, open_u, open_v; };

#ifdef UNIFORM
// K of the nodes in a column (or row) over that of the inner ones; see pack_cells.frag.
vec4 at_walls(vec4 place, float far) {
#ifdef NO_SLIP
    const float wall = 2.0;
#else
    const float wall = 0.0;
#endif
    return mix(vec4(1.0), vec4(wall), vec4(equal(place, vec4(0.0))) + vec4(equal(place, vec4(far))));
}

Faces inverse_diagonal(vec2 at) {
    vec4 i = columns(own_texel()), j = rows(own_texel());
    vec4 x = at_walls(i, u_box.x) + at_walls(i + 1.0, u_box.x), y = at_walls(j, u_box.y) + at_walls(j + 1.0, u_box.y);
    return Faces(open_u(own_texel()) / (1.0 + u_stiffness * (4.0 + y)), open_v(own_texel()) / (1.0 + u_stiffness * (4.0 + x)));
}

Stiffness read_stiffness(vec2 at) {
    vec4 i = columns(own_texel()), j = rows(own_texel());
    vec4 x = at_walls(i, u_box.x), y = at_walls(j, u_box.y);
    Stiffness k;
    k.open_u = open_u(own_texel());
    k.open_v = open_v(own_texel());
    k.left = k.here_x = k.above = k.here_y = vec4(2.0 * u_stiffness);
    k.node = u_stiffness * x * y;
    k.node_right = u_stiffness * at_walls(i + 1.0, u_box.x) * y;
    k.node_below = u_stiffness * x * at_walls(j + 1.0, u_box.y);
    return k;
}
#else
Faces inverse_diagonal(vec2 at) { return Faces(texture(u_inverse_u, at), texture(u_inverse_v, at)); }

Stiffness read_stiffness(vec2 at) {
    vec2 right = vec2(1.0 / float(textureSize(u_nodes, 0).x), 0.0), below = vec2(0.0, 1.0 / float(textureSize(u_nodes, 0).y));
    vec4 x = texture(u_cells_x, at), n = texture(u_nodes, at);
    vec4 x_left = abs(texture(u_cells_x, at - right));
    vec4 n_right = abs(texture(u_nodes, at + right)), n_below = abs(texture(u_nodes, at + below));
    Stiffness k;
    k.open_u = vec4(greaterThan(x, vec4(0.0)));
    k.open_v = vec4(greaterThan(n, vec4(0.0)));
    x = abs(x);
    n = abs(n);
#ifdef FINEST
    vec4 y = x, y_above = abs(texture(u_cells_x, at - below));
#else
    vec4 y = texture(u_cells_y, at), y_above = texture(u_cells_y, at - below);
#endif
    k.here_x = x;
    k.here_y = y;
    k.left = vec4(x_left.y, x.x, x_left.w, x.z);
    k.above = vec4(y_above.zw, y.xy);
    k.node = n;
    k.node_right = vec4(n.y, n_right.x, n.w, n_right.z);
    k.node_below = vec4(n.zw, n_below.xy);
    return k;
}
#endif

// 1 / diagonal of A, 0 for pinned faces.
Faces inverse_diagonal(Stiffness k) {
    return Faces(k.open_u / (1.0 + k.left + k.here_x + k.node + k.node_below),
                 k.open_v / (1.0 + k.above + k.here_y + k.node + k.node_right));
}

// A f for the texel at `at` of the faces in textures fu, fv; `here` becomes their own values. 12 reads.
Faces apply_matrix(sampler2D fu, sampler2D fv, vec2 at, Stiffness k, out Faces here) {
    vec2 x = vec2(1.0 / float(textureSize(fu, 0).x), 0.0), y = vec2(0.0, 1.0 / float(textureSize(fu, 0).y));
    vec4 u = texture(fu, at), v = texture(fv, at);
    vec4 u_left = texture(fu, at - x), u_right = texture(fu, at + x), u_up = texture(fu, at - y), u_down = texture(fu, at + y);
    vec4 v_left = texture(fv, at - x), v_right = texture(fv, at + x), v_up = texture(fv, at - y), v_down = texture(fv, at + y);
    float u_corner = texture(fu, at + x - y).z, v_corner = texture(fv, at - x + y).y;
    here = Faces(u, v);
    // Tensions in the cells either side of a face, and shear at the nodes.
    vec4 along_u = k.here_x * (vec4(u.y, u_right.x, u.w, u_right.z) - u) - k.left * (u - vec4(u_left.y, u.x, u_left.w, u.z));
    vec4 along_v = k.here_y * (vec4(v.zw, v_down.xy) - v) - k.above * (v - vec4(v_up.zw, v.xy));
    vec4 shear = k.node * (u - vec4(u_up.zw, u.xy) + v - vec4(v_left.y, v.x, v_left.w, v.z));
    vec2 shear_below = k.node_below.zw * (u_down.xy - u.zw + v_down.xy - vec2(v_corner, v_down.x));
    vec2 shear_right = k.node_right.yw * (u_right.xz - vec2(u_corner, u_right.x) + v_right.xz - v.yw);
    return Faces(u - along_u - vec4(shear.zw, shear_below) + shear,
                 v - along_v - vec4(shear.y, shear_right.x, shear.w, shear_right.y) + shear);
}
