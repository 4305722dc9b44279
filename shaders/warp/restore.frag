// Restore: D'(x) = (1 - amount falloff(|x - c|)) D(x), the map let go back to the identity under a brush.
// u_displacement: longer sides; u_window: left, top, width and height that it covers, u_center, u_radius: longer sides;
// u_hardness: the part of the radius that is fully under the brush, below 1; u_amount: 0-1.
// Define HELD if something is frozen; the nearer to it (u_near over the picture, u_picture its width and height, longer
// sides), the less does the map go back.
// reads: 1
uniform sampler2D u_displacement;
uniform vec4 u_window;
uniform vec2 u_center;
uniform float u_radius;
uniform float u_hardness;
uniform float u_amount;
#ifdef HELD
uniform sampler2D u_near;
uniform vec2 u_picture;
float freedom(vec2 x) { return 1.0 - texture(u_near, x / u_picture).r; }
#else
float freedom(vec2 x) { return 1.0; }
#endif
in vec2 v_uv;
layout(location = 0) out vec2 out_displacement;

void main() {
    vec2 x = u_window.xy + v_uv * u_window.zw;
    float far = length(x - u_center) / u_radius;
    float falloff = 1.0 - smoothstep(u_hardness, 1.0, far);
    out_displacement = (1.0 - u_amount * falloff * freedom(x)) * texture(u_displacement, v_uv).rg;
}
