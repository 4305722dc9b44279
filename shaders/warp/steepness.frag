// Steepness: |grad D|^2 at every second cell both ways, by central differences; at the edges, where the cells outside read
// as those inside, by half of the one-sided ones.
// u_displacement (D): cell centres, longer sides; u_spacing: distances of the centres, longer sides.
// reads: 4
uniform sampler2D u_displacement;
uniform vec2 u_spacing;
layout(location = 0) out float out_steepness;

vec2 change(vec2 place, vec2 step) { return texture(u_displacement, place + step).rg - texture(u_displacement, place - step).rg; }

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_displacement, 0)), place = (2.0 * gl_FragCoord.xy - 0.5) * texel;
    vec4 slope = 0.5 * vec4(change(place, vec2(texel.x, 0.0)), change(place, vec2(0.0, texel.y))) / u_spacing.xxyy;
    out_steepness = dot(slope, slope);
}
