// Curl: the flow of a stream function at the nodes, u = dpsi/dy, v = -dpsi/dx, drawn with additive blending; exactly free
// of divergence. The faces of walls stay at rest.
// u_stream: nodes, one more along each axis than there are cells, lengths^2 / s; u_spacing: sides of a cell, lengths.
// reads: 3
uniform sampler2D u_stream;
uniform vec2 u_spacing;
layout(location = 0) out vec2 out_velocity;

void main() {
    vec2 cell = gl_FragCoord.xy, texel = 1.0 / vec2(textureSize(u_stream, 0));
    float corner = texture(u_stream, cell * texel).r;
    vec2 velocity = vec2(texture(u_stream, (cell + vec2(0.0, 1.0)) * texel).r - corner,
                         corner - texture(u_stream, (cell + vec2(1.0, 0.0)) * texel).r);
    out_velocity = velocity / u_spacing.yx * vec2(greaterThan(cell, vec2(1.0)));
}
