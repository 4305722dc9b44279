// Restore: D'(x) = (1 - amount falloff(|x - c|)) D(x), the map let go back to the identity under a brush.
// u_displacement: longer sides; u_extent: width and height of the domain, u_center, u_radius: longer sides;
// u_hardness: the part of the radius that is fully under the brush, below 1; u_amount: 0-1.
// reads: 1
uniform sampler2D u_displacement;
uniform vec2 u_extent;
uniform vec2 u_center;
uniform float u_radius;
uniform float u_hardness;
uniform float u_amount;
in vec2 v_uv;
layout(location = 0) out vec2 out_displacement;

void main() {
    float far = length(v_uv * u_extent - u_center) / u_radius;
    float falloff = 1.0 - smoothstep(u_hardness, 1.0, far);
    out_displacement = (1.0 - u_amount * falloff) * texture(u_displacement, v_uv).rg;
}
