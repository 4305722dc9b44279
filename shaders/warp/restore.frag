// Restore: D'(x) = (1 - amount falloff(|x - c|)) D(x), the map let go back to the identity under a brush.
// u_displacement: longer sides; u_window: left, top, width and height that it covers, u_center, u_radius: longer sides;
// u_hardness: the part of the radius that is fully under the brush, below 1; u_amount: 0-1.
// Define HELD if there are cells, of u_held 1 in the window u_held_window, in which the map does not change; towards them
// it goes back less and less.
// reads: 1
uniform sampler2D u_displacement;
uniform vec4 u_window;
uniform vec2 u_center;
uniform float u_radius;
uniform float u_hardness;
uniform float u_amount;
#ifdef HELD
uniform sampler2D u_held;
uniform vec4 u_held_window;

// 0 in a held cell and along a straight edge of held ones, 1 where there is none within REACH cells.
float freedom(vec2 x) {
    const int REACH = 3;
    vec2 cell = 1.0 / vec2(textureSize(u_held, 0)), place = (x - u_held_window.xy) / u_held_window.zw;
    float held = 0.0;
    for (int j = -REACH; j <= REACH; ++j)
        for (int i = -REACH; i <= REACH; ++i) held += texture(u_held, place + vec2(i, j) * cell).r;
    float whole = float((2 * REACH + 1) * (2 * REACH + 1));
    return texture(u_held, place).r > 0.5 ? 0.0 : 1.0 - smoothstep(0.0, 0.5, held / whole);
}
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
