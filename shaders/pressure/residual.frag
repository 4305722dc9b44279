// What a correction leaves of the right-hand side:  r - A p;  with ONLY_LAPLACIAN:  A p.
// in:  u_pressure   the correction, pressure / h at blocks, lengths / s;  u_residual   r, lengths / s
//      u_left, u_up, u_far, u_span   faces
// With PRODUCTS: u_before, A q of the way before (none with FIRST), and a second output.
// out: lengths / s, with PRODUCTS A p;  products: (r . A p, A p . A p, A p . A q, r . r) over the block
// reads: 9
#include "lib/block_faces.glsl"

uniform sampler2D u_pressure;
uniform sampler2D u_residual;

layout(location = 0) out vec4 out_residual;
#ifdef PRODUCTS
uniform sampler2D u_before;
layout(location = 1) out vec4 out_products;
#endif

void main() {
    vec4 applied = laplacian(u_pressure, texture(u_pressure, v_uv), faces());
#ifdef PRODUCTS
    vec4 residual = texture(u_residual, v_uv), before = vec4(0.0);
#ifndef FIRST
    before = texture(u_before, v_uv);
#endif
    out_products = vec4(dot(residual, applied), dot(applied, applied), dot(applied, before), dot(residual, residual));
#endif
#if defined(ONLY_LAPLACIAN) || defined(PRODUCTS)
    out_residual = applied;
#else
    out_residual = texture(u_residual, v_uv) - applied;
#endif
}
