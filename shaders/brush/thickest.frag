// Thickest: the viscosity at the nodes, that of the thickest of the cells around, lengths^2 / s; at least 1e-9.
// u_viscosity: cells, lengths^2 / s.
// reads: 4
uniform sampler2D u_viscosity;
layout(location = 0) out float out_thickest;

void main() {
    vec2 node = gl_FragCoord.xy - 0.5, texel = 1.0 / vec2(textureSize(u_viscosity, 0));
    float thickest = 1e-9;
    for (int k = 0; k < 4; ++k)
        thickest = max(thickest, texture(u_viscosity, (node + vec2(k & 1, k >> 1) - 0.5) * texel).r);
    out_thickest = thickest;
}
