// Galerkin guess: texel by texel the scalar products that tell which a f + c d has least energy. f . A d is f . d and K
// times the strains of both, of which those on the far walls lie in the ring.
// u_u, u_v: f, the velocity before the viscous step; u_change_u, u_change_v: d, what the last step made of its own;
// u_rhs_u, u_rhs_v: the right-hand side b.
// Out: (b . f, b . d, f . A f, f . A d); d . A d.
// reads: 16
#include "viscosity/operator.glsl"
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_change_u;
uniform sampler2D u_change_v;
uniform sampler2D u_rhs_u;
uniform sampler2D u_rhs_v;
in vec2 v_uv;
layout(location = 0) out vec4 out_products;
layout(location = 1) out float out_change_product;

struct Strains { vec4 xx, yy, xy; };

Strains strains(sampler2D fu, sampler2D fv, vec2 at, out Faces here) {
    vec2 x = vec2(1.0 / float(textureSize(fu, 0).x), 0.0), y = vec2(0.0, 1.0 / float(textureSize(fu, 0).y));
    vec4 u = texture(fu, at), v = texture(fv, at), u_right = texture(fu, at + x), v_down = texture(fv, at + y);
    vec4 u_up = texture(fu, at - y), v_left = texture(fv, at - x);
    here = Faces(u, v);
    return Strains(vec4(u.y, u_right.x, u.w, u_right.z) - u, vec4(v.zw, v_down.xy) - v,
                   u_shear.x * (u - vec4(u_up.zw, u.xy)) + u_shear.y * (v - vec4(v_left.y, v.x, v_left.w, v.z)));
}

float product(Faces f, Faces g) { return dot(f.u, g.u) + dot(f.v, g.v); }

float product(Strains e, Strains f, Stiffness k) {
    return dot(k.here_x * e.xx, f.xx) + dot(k.here_y * e.yy, f.yy) + dot(k.node * e.xy, f.xy);
}

void main() {
    Stiffness k = read_stiffness(v_uv);
    Faces f, d, b = Faces(texture(u_rhs_u, v_uv), texture(u_rhs_v, v_uv));
    Strains of_f = strains(u_u, u_v, v_uv, f), of_d = strains(u_change_u, u_change_v, v_uv, d);
    out_products = vec4(product(b, f), product(b, d), product(f, f) + product(of_f, of_f, k),
                        product(f, d) + product(of_f, of_d, k));
    out_change_product = product(d, d) + product(of_d, of_d, k);
}
