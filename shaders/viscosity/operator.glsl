// The operator A v = v + B' K B v (equation V3) on packed faces: 2 x 2 of them a texel, (x, y, z, w) = upper left, upper right, lower
// left, lower right, u in one texture, v in another. Around the texels in use runs a ring of zeros, so that no stage asks
// for the edge: what lies beyond a wall is at rest. Fixed faces (walls, solid cells) hold exactly zero and are no unknowns.
// B: the strains e_xx and e_yy in cells (K = 2 dt mu / h^2), the shear s_y du + s_x dv at nodes (K = dt mu_node / h^2).
// UNIFORM: of one viscosity in a box without solids; nothing is read, all follows from the place.
// COARSE: K couples neighbouring strains; stress.frag has multiplied, and its stresses K B v are read here.
// Else, on the finest level, K of each cell and node is in textures.
uniform vec2 u_shear;           // (s_y, s_x): (1, 1) where cells are square
#include "viscosity/sides.glsl"
#ifdef UNIFORM
#include "viscosity/box.glsl"
uniform float u_stiffness;      // dt mu / (hx hy)
#else
#include "viscosity/openness.glsl"
uniform sampler2D u_inverse_u;  // 1 / diagonal of A for u and for v; 0 for fixed faces
uniform sampler2D u_inverse_v;
uniform sampler2D u_cells;      // K of e_xx in the cells, negative where the cell's left face is fixed
uniform sampler2D u_nodes;      // K of the cells' upper left nodes, negative where the cell's upper face is fixed
uniform float u_aspect;         // K of e_yy over K of e_xx
uniform sampler2D u_stress_xx;  // of the cells
uniform sampler2D u_stress_yy;
uniform sampler2D u_stress_xy;  // of the cells' upper left nodes
#endif

struct Faces { vec4 u, v; };

#ifndef COARSE
struct Stiffness { vec4 left, here_x, above, here_y, node, node_right, node_below, open_u, open_v; };
#endif

#ifdef UNIFORM
// K of the nodes in a column (or row) over that of the inner ones: see `Coefficients.uniform`.
vec4 at_walls(vec4 place, float far, vec2 no_slip) {
    return mix(mix(vec4(1.0), vec4(2.0 * no_slip.x), vec4(equal(place, vec4(0.0)))), vec4(2.0 * no_slip.y),
               vec4(equal(place, vec4(far))));
}
vec4 at_walls_x(vec4 place) { return at_walls(place, u_box.x, u_no_slip.xy); }
vec4 at_walls_y(vec4 place) { return at_walls(place, u_box.y, u_no_slip.zw); }

Stiffness read_stiffness(vec2 at) {
    vec4 i = columns(own_texel()), j = rows(own_texel());
    vec4 x = at_walls_x(i), y = at_walls_y(j);
    Stiffness k;
    k.open_u = open_u(own_texel());
    k.open_v = open_v(own_texel());
    k.left = k.here_x = vec4(2.0 * u_stiffness * u_shear.y * u_shear.y);
    k.above = k.here_y = vec4(2.0 * u_stiffness * u_shear.x * u_shear.x);
    k.node = u_stiffness * x * y;
    k.node_right = u_stiffness * at_walls_x(i + 1.0) * y;
    k.node_below = u_stiffness * x * at_walls_y(j + 1.0);
    return k;
}

Faces inverse_diagonal(vec2 at) {
    vec4 i = columns(own_texel()), j = rows(own_texel());
    vec4 x = at_walls_x(i) + at_walls_x(i + 1.0), y = at_walls_y(j) + at_walls_y(j + 1.0);
    vec2 s = u_stiffness * u_shear * u_shear;
    return Faces(open_u(own_texel()) / (1.0 + 4.0 * s.y + s.x * y), open_v(own_texel()) / (1.0 + 4.0 * s.x + s.y * x));
}
#else
Faces inverse_diagonal(vec2 at) { return Faces(texture(u_inverse_u, at), texture(u_inverse_v, at)); }
#endif

#if !defined(UNIFORM) && !defined(COARSE)
Stiffness read_stiffness(vec2 at) {
    vec2 right = vec2(1.0 / float(textureSize(u_nodes, 0).x), 0.0), below = vec2(0.0, 1.0 / float(textureSize(u_nodes, 0).y));
    vec4 x = texture(u_cells, at), n = texture(u_nodes, at);
    vec4 x_left = abs(texture(u_cells, at - right)), x_above = abs(texture(u_cells, at - below));
    vec4 n_right = abs(texture(u_nodes, at + right)), n_below = abs(texture(u_nodes, at + below));
    Stiffness k;
    k.open_u = vec4(greaterThan(x, vec4(0.0)));
    k.open_v = vec4(greaterThan(n, vec4(0.0)));
    x = abs(x);
    n = abs(n);
    k.here_x = x;
    k.left = vec4(x_left.y, x.x, x_left.w, x.z);
    k.here_y = u_aspect * x;
    k.above = u_aspect * vec4(x_above.zw, x.xy);
    k.node = n;
    k.node_right = vec4(n.y, n_right.x, n.w, n_right.z);
    k.node_below = vec4(n.zw, n_below.xy);
    return k;
}
#endif

#ifdef COARSE
// A f for the texel at `at`; `here` becomes the faces' own values, `is_open` 1 for those that move. 10 reads.
Faces apply_operator(sampler2D fu, sampler2D fv, vec2 at, out Faces here, out Faces is_open) {
    vec2 x = vec2(1.0 / float(textureSize(fu, 0).x), 0.0), y = vec2(0.0, 1.0 / float(textureSize(fu, 0).y));
    here = Faces(texture(fu, at), texture(fv, at));
    is_open = Faces(open_u(own_texel()), open_v(own_texel()));
    vec4 xx = texture(u_stress_xx, at), left = texture(u_stress_xx, at - x);
    vec4 yy = texture(u_stress_yy, at), above = texture(u_stress_yy, at - y);
    vec4 xy = texture(u_stress_xy, at), right = texture(u_stress_xy, at + x), below = texture(u_stress_xy, at + y);
    return Faces(here.u + vec4(left.y, xx.x, left.w, xx.z) - xx + u_shear.x * (xy - vec4(xy.zw, below.xy)),
                 here.v + vec4(above.zw, yy.xy) - yy + u_shear.y * (xy - vec4(xy.y, right.x, xy.w, right.z)));
}
#else
// A texel's faces and those that they are coupled with. 12 reads.
struct Around { vec4 u, u_left, u_right, u_up, u_down, v, v_left, v_right, v_up, v_down; float u_corner, v_corner; };

Around read_around(sampler2D fu, sampler2D fv, vec2 at) {
    vec2 x = vec2(1.0 / float(textureSize(fu, 0).x), 0.0), y = vec2(0.0, 1.0 / float(textureSize(fu, 0).y));
    return Around(texture(fu, at), texture(fu, at - x), texture(fu, at + x), texture(fu, at - y), texture(fu, at + y),
                  texture(fv, at), texture(fv, at - x), texture(fv, at + x), texture(fv, at - y), texture(fv, at + y),
                  texture(fu, at + x - y).z, texture(fv, at - x + y).y);
}

// B f of the texel's cells, and of their upper left nodes.
vec4 strain_xx(Around f) { return vec4(f.u.y, f.u_right.x, f.u.w, f.u_right.z) - f.u; }
vec4 strain_yy(Around f) { return vec4(f.v.zw, f.v_down.xy) - f.v; }
vec4 strain_xy(Around f) {
    return u_shear.x * (f.u - vec4(f.u_up.zw, f.u.xy)) + u_shear.y * (f.v - vec4(f.v_left.y, f.v.x, f.v_left.w, f.v.z));
}

Faces apply_operator(Around f, Stiffness k) {
    // Tensions in the cells either side of a face, and shear at the nodes.
    vec4 along_u = k.here_x * strain_xx(f) - k.left * (f.u - vec4(f.u_left.y, f.u.x, f.u_left.w, f.u.z));
    vec4 along_v = k.here_y * strain_yy(f) - k.above * (f.v - vec4(f.v_up.zw, f.v.xy));
    vec4 shear = k.node * strain_xy(f);
    vec2 shear_below = k.node_below.zw * (u_shear.x * (f.u_down.xy - f.u.zw) + u_shear.y * (f.v_down.xy - vec2(f.v_corner, f.v_down.x)));
    vec2 shear_right = k.node_right.yw * (u_shear.x * (f.u_right.xz - vec2(f.u_corner, f.u_right.x)) + u_shear.y * (f.v_right.xz - f.v.yw));
    return Faces(f.u - along_u + u_shear.x * (shear - vec4(shear.zw, shear_below)),
                 f.v - along_v + u_shear.y * (shear - vec4(shear.y, shear_right.x, shear.w, shear_right.y)));
}

// The same as above, the stresses made on the way; and 6 reads of textures of K.
Faces apply_operator(sampler2D fu, sampler2D fv, vec2 at, Stiffness k, out Faces here) {
    Around f = read_around(fu, fv, at);
    here = Faces(f.u, f.v);
    return apply_operator(f, k);
}

Faces apply_operator(sampler2D fu, sampler2D fv, vec2 at, out Faces here, out Faces is_open) {
    Stiffness k = read_stiffness(at);
    is_open = Faces(k.open_u, k.open_v);
    return apply_operator(fu, fv, at, k, here);
}
#endif
