// Gather loads: force and torque of the residual on each part of the coarse space, Z' r; a texel for each part.
// u_tiles: (first texel x, y, centre x, centre y) by part, cells; u_u, u_v: the residual; u_part_u, u_part_v: the part
// that each face belongs to, 0 for none; u_shear: (s_y, s_x), see operator.glsl. SIDE: texels along a tile and one more.
// reads: 101
#ifndef SIDE
#define SIDE 5
#endif
uniform sampler2D u_tiles;
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_part_u;
uniform sampler2D u_part_v;
uniform vec2 u_shear;
layout(location = 0) out vec4 out_load;

void main() {
    vec4 tile = texelFetch(u_tiles, ivec2(gl_FragCoord.xy), 0);
    float part = floor(gl_FragCoord.y) * float(textureSize(u_tiles, 0).x) + floor(gl_FragCoord.x);
    ivec2 first = ivec2(tile.xy), last = textureSize(u_u, 0) - 1;
    out_load = vec4(0.0);
    for (int j = 0; j < SIDE; ++j)
        for (int i = 0; i < SIDE; ++i) {
            ivec2 t = min(first + ivec2(i, j), last); // the ring belongs to no part
            vec4 u = texelFetch(u_u, t, 0) * vec4(equal(texelFetch(u_part_u, t, 0), vec4(part)));
            vec4 v = texelFetch(u_v, t, 0) * vec4(equal(texelFetch(u_part_v, t, 0), vec4(part)));
            vec2 corner = 2.0 * vec2(t - 1);
            vec4 y = (corner.y + vec4(0.5, 0.5, 1.5, 1.5)) / u_shear.x - tile.w;
            vec4 x = (corner.x + vec4(0.5, 1.5, 0.5, 1.5)) / u_shear.y - tile.z;
            out_load.xyz += vec3(dot(u, vec4(1.0)), dot(v, vec4(1.0)), dot(x, v) - dot(y, u));
        }
}
