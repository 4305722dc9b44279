// Transform: matrices times the rows of the faces of a grid, or with DOWN their columns; one direction of the sine and
// cosine transforms of solver/viscosity/transform.py. With SOLVE the viscous step is made on the modes that come out,
// (1 + A) w = b, where for the wave numbers p, q in a box of n x m cells, with (k_x, k_y) = u_stiffness,
// a = 2 k_x sin(pi p / 2 n), b = 2 k_y sin(pi q / 2 m):
//   A = (2 a^2 + b^2   a b        )
//       (a b           2 b^2 + a^2)
// u_u, u_v: packed as in operator.glsl; u_matrix_u, u_matrix_v: a texel at (j, k) holds the 2 x 2 entries from texel j to
// texel k, row after row; u_stiffness: square roots of dt mu / hx^2 and dt mu / hy^2; u_box: (n, m).
// reads: 128
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_matrix_u;
uniform sampler2D u_matrix_v;
#ifdef SOLVE
uniform vec2 u_stiffness;
uniform vec2 u_box;
#endif

in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

#ifdef DOWN
vec4 product(vec4 m, vec4 f) { return m.xxzz * f.xyxy + m.yyww * f.zwzw; }
#else
vec4 product(vec4 m, vec4 f) { return m.xzxz * f.xxzz + m.ywyw * f.yyww; }
#endif

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_u, 0)), own = floor(gl_FragCoord.xy) - 1.0;
    int count = textureSize(u_matrix_u, 0).x;
    float entry = 1.0 / float(count);
    out_u = out_v = vec4(0.0);
    for (int j = 0; j < count; ++j) {
#ifdef DOWN
        vec2 from = vec2(v_uv.x, (float(j) + 1.5) * texel.y), at = (vec2(float(j), own.y) + 0.5) * entry;
#else
        vec2 from = vec2((float(j) + 1.5) * texel.x, v_uv.y), at = (vec2(float(j), own.x) + 0.5) * entry;
#endif
        out_u += product(texture(u_matrix_u, at), texture(u_u, from));
        out_v += product(texture(u_matrix_v, at), texture(u_v, from));
    }
#ifdef SOLVE
    const float PI = 3.14159265358979;
    vec4 a = 2.0 * u_stiffness.x * sin(0.5 * PI * (2.0 * own.x + vec4(0.0, 1.0, 0.0, 1.0)) / u_box.x);
    vec4 b = 2.0 * u_stiffness.y * sin(0.5 * PI * (2.0 * own.y + vec4(0.0, 0.0, 1.0, 1.0)) / u_box.y);
    vec4 uu = 1.0 + 2.0 * a * a + b * b, vv = 1.0 + 2.0 * b * b + a * a;
    vec4 uv = a * b, u = out_u, over = 1.0 / (uu * vv - uv * uv);
    out_u = over * (vv * u - uv * out_v);
    out_v = over * (uu * out_v - uv * u);
#endif
}
