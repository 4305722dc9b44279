// Right-hand side of the pressure equation: the side of a cell times the divergence, less what is wanted and expected.
//   r = u_right - u_left + aspect (v_down - v_up) [- s] [- A p]          A p = r is to be solved
// in:  u_velocity   MAC velocity, lengths / s; with PACKED u_u, u_v, the same as viscosity/operator.glsl packs it
//      links of lib/block.glsl
// With SOURCE: u_source, the side times the wanted divergence, at cells, lengths / s, 0 in the mean over closed regions.
// With EXPECTED: u_expected, p at blocks, lengths / s.
// out: r at blocks, lengths / s;  squares summed over the block: R without what is expected, G of r, B of all that the
//      former is a difference of, each face once
// reads: 20
#include "lib/block.glsl"

#ifdef PACKED
uniform sampler2D u_u;
uniform sampler2D u_v;
#else
uniform sampler2D u_velocity;
#endif
uniform sampler2D u_source;
uniform sampler2D u_expected;

in vec2 v_uv;
layout(location = 0) out vec4 out_residual;
layout(location = 1) out vec4 out_squares;

// The velocity at the four cells' left, right, upper and lower faces.
void read_faces(out vec4 left, out vec4 right, out vec4 up, out vec4 down) {
#ifdef PACKED
    vec2 texel = 1.0 / vec2(textureSize(u_u, 0)), here = (floor(gl_FragCoord.xy) + 1.5) * texel;
    left = texture(u_u, here);
    up = texture(u_v, here);
    vec2 beyond = texture(u_u, here + vec2(texel.x, 0.0)).xz;
    right = vec4(left.y, beyond.x, left.w, beyond.y);
    down = vec4(up.zw, texture(u_v, here + vec2(0.0, texel.y)).xy);
#else
    vec2 texel = 1.0 / vec2(textureSize(u_velocity, 0)), a = (2.0 * floor(gl_FragCoord.xy) + 0.5) * texel;
    vec2 b = a + texel, c = b + texel;
    vec2 v00 = texture(u_velocity, a).rg, v10 = texture(u_velocity, vec2(b.x, a.y)).rg;
    vec2 v01 = texture(u_velocity, vec2(a.x, b.y)).rg, v11 = texture(u_velocity, b).rg;
    vec2 far = vec2(texture(u_velocity, vec2(c.x, a.y)).r, texture(u_velocity, vec2(c.x, b.y)).r);
    vec2 below = vec2(texture(u_velocity, vec2(a.x, c.y)).g, texture(u_velocity, vec2(b.x, c.y)).g);
    left = vec4(v00.x, v10.x, v01.x, v11.x);
    right = vec4(v10.x, far.x, v11.x, far.y);
    up = vec4(v00.y, v10.y, v01.y, v11.y);
    down = vec4(v01.y, v11.y, below);
#endif
}

void main() {
    Links f = links_of(floor(gl_FragCoord.xy), v_uv);
    vec4 left, right, up, down;
    read_faces(left, right, up, down);
    // The weights down hold the aspect squared.
    left *= f.left;
    up *= f.up / u_aspect;
    out_residual = f.right * right - left + f.down * down / u_aspect - up;
    float terms = dot(left, left) + dot(up, up);
#ifdef SOURCE
    vec2 texel = 1.0 / vec2(textureSize(u_source, 0)), a = (2.0 * floor(gl_FragCoord.xy) + 0.5) * texel, b = a + texel;
    vec2 inside = vec2(lessThan(b, vec2(1.0)));  // a block at the edge may have cells beyond it
    vec4 source = vec4(texture(u_source, a).r, texture(u_source, vec2(b.x, a.y)).r,
                       texture(u_source, vec2(a.x, b.y)).r, texture(u_source, b).r)
                * vec2(1.0, inside.x).xyxy * vec2(1.0, inside.y).xxyy;
    out_residual -= source;
    terms += dot(source, source);
#endif
    out_squares = vec4(vec2(dot(out_residual, out_residual)), terms, 0.0);
#ifdef EXPECTED
    out_residual -= laplacian(u_expected, v_uv, texture(u_expected, v_uv), f);
    out_squares.y = dot(out_residual, out_residual);
#endif
}
