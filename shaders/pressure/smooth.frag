// One sweep of weighted Jacobi:  p += weight (A p - r) / (sum of the openness of the cell's faces; 4 with WHOLE, where the
// eigenvalues of A / 4 go from 0 to 2 whatever the walls).
// in:  u_pressure   pressure / h at blocks, lengths / s;  u_residual   right-hand side r, lengths / s
//      u_left, u_up, u_far, u_span   faces;  u_weight   of this sweep, from the roots of a Chebyshev polynomial
// out: pressure / h
// reads: 9
#include "lib/block_faces.glsl"

uniform sampler2D u_pressure;
uniform sampler2D u_residual;
uniform float u_weight;

out vec4 out_pressure;

void main() {
    Faces f = faces();
    vec4 p = texture(u_pressure, v_uv);
#ifdef WHOLE
    float weight = 0.25 * u_weight;
#else
    vec4 sum = openness(f), weight = u_weight * vec4(greaterThan(sum, vec4(0.0))) / max(sum, 1e-3);
#endif
    out_pressure = p + weight * (laplacian(u_pressure, p, f) - texture(u_residual, v_uv));
}
