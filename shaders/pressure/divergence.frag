// Right-hand side of the pressure equation: what flows out of each cell, per face length; h times the divergence.
//   r = u_right - u_left + v_down - v_up  [- (s - mean)]          sum over open faces of (p' - p) = r
// in:  u_velocity   MAC velocity, lengths / s; with PACKED u_u, u_v, the same as viscosity/operator.glsl packs it
//      u_left, u_up, u_far, u_span   faces
// With WITH_SOURCE: u_source, h s at blocks, lengths / s; u_mean, its mean over the fluid.
// With EXPECTED: u_expected, a pressure / h at blocks, lengths / s, that is subtracted: r - A p; and a second output.
// out: r at blocks, lengths / s;  squares: R of r, G of r - A p, over the block
// reads: 16
#include "lib/block_faces.glsl"

#ifdef PACKED
uniform sampler2D u_u;
uniform sampler2D u_v;
#else
uniform sampler2D u_velocity;
#endif
#ifdef WITH_SOURCE
uniform sampler2D u_source;
uniform float u_mean;
#endif

layout(location = 0) out vec4 out_residual;
#ifdef EXPECTED
uniform sampler2D u_expected;
layout(location = 1) out vec4 out_squares;

// Sum of the squares, and that of what differs from the block's mean.
vec2 squares(vec4 r) {
    float whole = dot(r, r), sum = dot(r, vec4(1.0));
    return vec2(whole, whole - 0.25 * sum * sum);
}
#endif

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
    Faces f = faces();
    vec4 left, right, up, down;
    read_faces(left, right, up, down);
    out_residual = f.right * right - f.left * left + f.down * down - f.up * up;
#ifdef WITH_SOURCE
    out_residual -= texture(u_source, v_uv) - u_mean * live(f);
#endif
#ifdef EXPECTED
    out_squares.xy = squares(out_residual);
    out_residual -= laplacian(u_expected, texture(u_expected, v_uv), f);
    out_squares.zw = squares(out_residual);
#endif
}
