// Steepness: |grad D|^2 at every corner that four cells share, by the differences of their means.
// u_displacement (D): cell centres, longer sides; u_spacing: distances of the centres, longer sides.
// reads: 4
uniform sampler2D u_displacement;
uniform vec2 u_spacing;
layout(location = 0) out float out_steepness;

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_displacement, 0)), a = gl_FragCoord.xy * texel, b = a + texel;
    vec2 upper_left = texture(u_displacement, a).rg, upper_right = texture(u_displacement, vec2(b.x, a.y)).rg;
    vec2 lower_left = texture(u_displacement, vec2(a.x, b.y)).rg, lower_right = texture(u_displacement, b).rg;
    vec2 across = upper_right + lower_right - upper_left - lower_left, down = lower_left + lower_right - upper_left - upper_right;
    vec4 slope = 0.5 * vec4(across, down) / u_spacing.xxyy;
    out_steepness = dot(slope, slope);
}
