// Spread motions: every face moves with the part of the coarse space that it belongs to, Z times the motions. OTHERS: a face
// of no part moves as before, u_u, u_v; STILL: no part moves.
// u_motions: (a, b, w) by part, the velocity (a - w y, b + w x); part 0 does not move.
// u_part_u, u_part_v: the part each belongs to; u_shear: (s_y, s_x), see operator.glsl. WIDE: texels of
// a row of u_motions.
// reads: 12
#ifndef WIDE
#define WIDE 64
#endif
uniform sampler2D u_motions;
uniform sampler2D u_part_u;
uniform sampler2D u_part_v;
uniform vec2 u_shear;
#ifdef OTHERS
uniform sampler2D u_u;
uniform sampler2D u_v;
#endif
in vec2 v_uv;
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;

vec3 motion(float part) {
#ifdef STILL
    return vec3(0.0);
#else
    int number = int(part);
    return texelFetch(u_motions, ivec2(number % WIDE, number / WIDE), 0).xyz;
#endif
}

void main() {
    vec4 part_u = texture(u_part_u, v_uv), part_v = texture(u_part_v, v_uv);
    vec2 corner = 2.0 * (floor(gl_FragCoord.xy) - 1.0);
    vec4 y = (corner.y + vec4(0.5, 0.5, 1.5, 1.5)) / u_shear.x, x = (corner.x + vec4(0.5, 1.5, 0.5, 1.5)) / u_shear.y;
    for (int q = 0; q < 4; ++q) {
        vec3 of_u = motion(part_u[q]), of_v = motion(part_v[q]);
        out_u[q] = of_u.x - of_u.z * y[q];
        out_v[q] = of_v.y + of_v.z * x[q];
    }
#ifdef OTHERS
    out_u = mix(out_u, texture(u_u, v_uv), vec4(equal(part_u, vec4(0.0))));
    out_v = mix(out_v, texture(u_v, v_uv), vec4(equal(part_v, vec4(0.0))));
#endif
}
