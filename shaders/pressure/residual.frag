// What a correction leaves of the right-hand side:  r - A p;  with ONLY_LAPLACIAN:  A p.
// in:  u_pressure   the correction, pressure / h at blocks, lengths / s;  u_residual   r, lengths / s
//      u_left, u_up, u_far, u_span   faces
// out: lengths / s
// reads: 9
#include "lib/block_faces.glsl"

uniform sampler2D u_pressure;
uniform sampler2D u_residual;

out vec4 out_residual;

void main() {
    vec4 applied = laplacian(u_pressure, texture(u_pressure, v_uv), faces());
#ifdef ONLY_LAPLACIAN
    out_residual = applied;
#else
    out_residual = texture(u_residual, v_uv) - applied;
#endif
}
