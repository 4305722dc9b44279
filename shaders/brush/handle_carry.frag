// Handle carry: the local part of handles' motions, each b V and nothing beside it, out of a list and drawn with additive
// blending; less its image beyond a wall that it pushes at or from, and with SOLIDS less beside what is closed, as carry.frag.
// v_brush, v_vector (V): see lib/listed.vert; u_distance: cells, lengths to what is closed.
// vertices: lib/listed.vert
// reads: 0, and 3 with SOLIDS
flat in vec4 v_brush;
flat in vec4 v_vector;
#ifdef SOLIDS
uniform sampler2D u_distance;
#endif
uniform vec2 u_texels;
layout(location = 0) out vec2 out_velocity;

float weight(vec2 x) {
    vec2 r = (x - v_brush.xy) / v_brush.z;
    float w = max(1.0 - dot(r, r), 0.0);
    return w * w * w;
}

void main() {
    vec2 p = gl_FragCoord.xy, spacing = v_vector.zw, u = (p - vec2(0.5, 0.0)) * spacing, v = (p - vec2(0.0, 0.5)) * spacing;
    vec2 far = 2.0 * spacing * u_texels;
    vec2 part = vec2(weight(u) - weight(vec2(-u.x, u.y)) - weight(vec2(far.x - u.x, u.y)),
                     weight(v) - weight(vec2(v.x, -v.y)) - weight(vec2(v.x, far.y - v.y)));
#ifdef SOLIDS
    vec2 texel = 1.0 / u_texels, uv = p * texel, left = uv - vec2(texel.x, 0.0), above = uv - vec2(0.0, texel.y);
    vec2 both = texture(u_distance, uv).r + vec2(texture(u_distance, left).r, texture(u_distance, above).r);
    part *= smoothstep(0.0, v_brush.z, 0.5 * both);
#endif
    out_velocity = max(part, 0.0) * v_vector.xy * vec2(greaterThan(p, vec2(1.0)));
}
