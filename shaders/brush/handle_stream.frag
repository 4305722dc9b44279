// Handle stream: the stream function at the nodes of pushes out of a list, drawn with additive blending, each:
//   psi = w(r / radius) (F x r),   w(q) = (1 - q)^5 (1 + 5 q)   up to 1, 0 beyond
// Its curl is F at the middle. The kernel F -> curl psi is minus the curl of the curl of Wendland's phi_3,2 =
// (1 - q)^6 (35 q^2 + 18 q + 3), so positive definite: handles at different places can be led each as it wants
// (Narcowich and Ward 1994).
// v_brush, v_vector (F): see lib/listed.vert.
// vertices: lib/listed.vert
// reads: 0
flat in vec4 v_brush;
flat in vec4 v_vector;
layout(location = 0) out float out_stream;

void main() {
    vec2 node = floor(gl_FragCoord.xy), r = node * v_vector.zw - v_brush.xy;
    float q = min(length(r) / v_brush.z, 1.0), far = 1.0 - q, far2 = far * far;
    out_stream = far2 * far2 * far * (1.0 + 5.0 * q) * (v_vector.x * r.y - v_vector.y * r.x);
}
