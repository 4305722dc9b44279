// Calm: takes away what flows under handles that the map bears no farther, drawn with additive blending:
//   (product over the handles of 1 - s w(r / radius) - 1) u,   w(q) = (1 - q^2)^3
// u_handles: x, y (from the grid's corner), radius, lengths, and s, 0-1, a texel each; u_velocity: MAC faces, lengths / s;
// u_spacing: sides of a cell, lengths.
// reads: 2, and one more for each handle
uniform sampler2D u_handles;
uniform sampler2D u_velocity;
uniform vec2 u_spacing;
layout(location = 0) out vec2 out_velocity;

void main() {
    vec2 p = gl_FragCoord.xy, at_u = (p - vec2(0.5, 0.0)) * u_spacing, at_v = (p - vec2(0.0, 0.5)) * u_spacing;
    vec2 kept = vec2(1.0);
    for (int i = 0; i < textureSize(u_handles, 0).x; ++i) {
        vec4 handle = texelFetch(u_handles, ivec2(i, 0), 0);
        vec2 q = vec2(distance(at_u, handle.xy), distance(at_v, handle.xy)) / handle.z, w = max(1.0 - q * q, 0.0);
        kept *= 1.0 - handle.w * w * w * w;
    }
    out_velocity = (kept - 1.0) * texelFetch(u_velocity, ivec2(p), 0).rg;
}
