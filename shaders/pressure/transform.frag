// A matrix times the rows of a level, or with DOWN its columns: one direction of the solve of solver/pressure/transform.py.
//   out(k, y) = sum over j of M(k, j) in(j, y);  with SCALED the sum times u_scale(k, y)
// in:  u_field, u_scale   at blocks
//      u_matrix           a texel at (j, k) holds M's 2 x 2 entries from blocks j to blocks k, row after row
// out: at blocks
// reads: 64
uniform sampler2D u_field;
uniform sampler2D u_matrix;
uniform sampler2D u_scale;

in vec2 v_uv;
out vec4 out_field;

void main() {
    vec4 sum = vec4(0.0);
#ifdef DOWN
    float texel = 1.0 / float(textureSize(u_field, 0).y);
    for (float place = 0.5 * texel; place < 1.0; place += texel) {
        vec4 f = texture(u_field, vec2(v_uv.x, place)), m = texture(u_matrix, vec2(place, v_uv.y));
        sum += m.xxzz * f.xyxy + m.yyww * f.zwzw;
    }
#else
    float texel = 1.0 / float(textureSize(u_field, 0).x);
    for (float place = 0.5 * texel; place < 1.0; place += texel) {
        vec4 f = texture(u_field, vec2(place, v_uv.y)), m = texture(u_matrix, vec2(place, v_uv.x));
        sum += m.xzxz * f.xxzz + m.ywyw * f.yyww;
    }
#endif
#ifdef SCALED
    sum *= texture(u_scale, v_uv);
#endif
    out_field = sum;
}
