// Guess residual: what the first guess a f + c d leaves, b - A (a f + c d); and texel by texel the scalar products that
// tell which a and c have least energy. f . A d is f . d and K times the strains of both, of which those on the far walls
// lie in the ring.
// u_u, u_v: f, the velocity before the viscous step; u_change_u, u_change_v: d, what the last step made of its own;
// u_rhs_u, u_rhs_v: the right-hand side b; u_parts: (a, c).
// Out: the residual r; (b . f, b . d, f . A f, f . A d); (d . A d, r . r).
// reads: 28
#include "viscosity/operator.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_change_u;
uniform sampler2D u_change_v;
uniform sampler2D u_rhs_u;
uniform sampler2D u_rhs_v;
uniform vec2 u_parts;
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;
layout(location = 2) out vec4 out_products;
layout(location = 3) out vec2 out_more_products;

float product(Around f, Around g, Stiffness k) {
    return dot(f.u, g.u) + dot(f.v, g.v) + dot(k.here_x * strain_xx(f), strain_xx(g))
         + dot(k.here_y * strain_yy(f), strain_yy(g)) + dot(k.node * strain_xy(f), strain_xy(g));
}

void main() {
    Stiffness k = read_stiffness(v_uv);
    Around f = read_around(u_u, u_v, v_uv), d = read_around(u_change_u, u_change_v, v_uv);
    Faces b = Faces(texture(u_rhs_u, v_uv), texture(u_rhs_v, v_uv)), af = apply_operator(f, k), ad = apply_operator(d, k);
    out_u = k.open_u * (b.u - u_parts.x * af.u - u_parts.y * ad.u);
    out_v = k.open_v * (b.v - u_parts.x * af.v - u_parts.y * ad.v);
    out_products = vec4(dot(b.u, f.u) + dot(b.v, f.v), dot(b.u, d.u) + dot(b.v, d.v), product(f, f, k), product(f, d, k));
    out_more_products = vec2(product(d, d, k), dot(out_u, out_u) + dot(out_v, out_v));
}
