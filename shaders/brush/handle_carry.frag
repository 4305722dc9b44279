// Handle carry: the local part of handles' motions, each b V and nothing beside it, out of a list and drawn with additive
// blending; less its image beyond a wall that it pushes at or from, as carry.frag.
// v_brush, v_vector (V): see lib/listed.vert; u_viscosity: cells, lengths^2 / s: what is thicker than at the tip is carried
// less.
// vertices: lib/listed.vert
// reads: 3
uniform sampler2D u_viscosity;
flat in vec4 v_brush;
flat in vec4 v_vector;
layout(location = 0) out vec2 out_velocity;

float weight(vec2 x) {
    vec2 r = (x - v_brush.xy) / v_brush.z;
    float w = max(1.0 - dot(r, r), 0.0);
    return w * w * w;
}

void main() {
    vec2 p = gl_FragCoord.xy, texel = 1.0 / vec2(textureSize(u_viscosity, 0)), spacing = v_vector.zw, uv = p * texel;
    vec2 u = (p - vec2(0.5, 0.0)) * spacing, v = (p - vec2(0.0, 0.5)) * spacing, far = 2.0 * spacing / texel;
    vec2 part = vec2(weight(u) - weight(vec2(-u.x, u.y)) - weight(vec2(far.x - u.x, u.y)),
                     weight(v) - weight(vec2(v.x, -v.y)) - weight(vec2(v.x, far.y - v.y)));
    vec2 before = vec2(texture(u_viscosity, uv - vec2(texel.x, 0.0)).r, texture(u_viscosity, uv - vec2(0.0, texel.y)).r);
    vec2 thickest = max(max(before, texture(u_viscosity, uv).r), 1e-9);
    out_velocity = min(max(v_brush.w, 1e-9) / thickest, 1.0) * max(part, 0.0) * v_vector.xy * vec2(greaterThan(p, vec2(1.0)));
}
