// Gather: force and torque of the residual on each stiff part, tile by tile (8 x 8 texels); an entry is a tile of a part.
// u_entries: (first texel x, y, part, 0); u_parts: (., ., centre x, centre y) by part, in cells; u_u, u_v: the residual;
// u_part_u, u_part_v: the part each face belongs to, 0 for none; 8 bits.
// reads: 258
uniform sampler2D u_entries;
uniform sampler2D u_parts;
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_part_u;
uniform sampler2D u_part_v;
layout(location = 0) out vec4 out_load;

vec4 numbers(sampler2D part, ivec2 t) { return floor(255.0 * texelFetch(part, t, 0) + 0.5); }

void main() {
    vec4 entry = texelFetch(u_entries, ivec2(gl_FragCoord.xy), 0);
    vec2 centre = texelFetch(u_parts, ivec2(entry.z, 0), 0).zw;
    ivec2 first = ivec2(entry.xy), last = textureSize(u_u, 0) - 1;
    out_load = vec4(0.0);
    if (entry.z < 0.5) return;
    for (int j = 0; j < 8; ++j)
        for (int i = 0; i < 8; ++i) {
            ivec2 t = min(first + ivec2(i, j), last); // the ring belongs to no part
            vec4 u = texelFetch(u_u, t, 0) * vec4(equal(numbers(u_part_u, t), vec4(entry.z)));
            vec4 v = texelFetch(u_v, t, 0) * vec4(equal(numbers(u_part_v, t), vec4(entry.z)));
            vec2 corner = 2.0 * vec2(t - 1) - centre;
            vec4 y = corner.y + vec4(0.5, 0.5, 1.5, 1.5), x = corner.x + vec4(0.5, 1.5, 0.5, 1.5);
            out_load.xyz += vec3(dot(u, vec4(1.0)), dot(v, vec4(1.0)), dot(x, v) - dot(y, u));
        }
}
