// Restore: D'(x) = m D(x), m = 1 - amount falloff(|x - c|), the map let go back to the identity under a brush.
// Define UNDONE to draw what is undone of the closed maps that follow D: u_undone, the way E and the part T (S9). D' is
// shorter by (1 - m) D, which is added to the way to where they are read, E' = E + (1 - m) D; of what they give m is left,
// 1 - T' = m (1 - T).
// u_displacement: longer sides; u_window: left, top, width and height that it covers, u_center, u_radius: longer sides;
// u_hardness: the part of the radius that is fully under the brush, below 1; u_amount: 0-1.
// Define HELD if something is held: in cells of u_still, on the window u_still_window, not at all, over one cell more and more.
// reads: 1, and 4 more with HELD, 1 with UNDONE
uniform sampler2D u_displacement;
uniform vec4 u_window;
uniform vec2 u_center;
uniform float u_radius;
uniform float u_hardness;
uniform float u_amount;
#ifdef HELD
uniform sampler2D u_still;
uniform vec4 u_still_window;
// Bilinear: exactly 0 between four cells that are still.
float freedom(vec2 x) {
    vec2 size = vec2(textureSize(u_still, 0)), place = (x - u_still_window.xy) / u_still_window.zw * size - 0.5;
    vec2 cell = floor(place), f = place - cell;
    vec4 at = vec4(cell + 0.5, cell + 1.5) / size.xyxy;
    vec4 free = 1.0 - vec4(texture(u_still, at.xy).r, texture(u_still, at.zy).r, texture(u_still, at.xw).r, texture(u_still, at.zw).r);
    vec2 along = mix(free.xz, free.yw, f.x);
    return smoothstep(0.0, 1.0, mix(along.x, along.y, f.y));
}
#else
float freedom(vec2 x) { return 1.0; }
#endif
in vec2 v_uv;
#ifdef UNDONE
uniform sampler2D u_undone;
layout(location = 0) out vec4 out_undone;
#else
layout(location = 0) out vec2 out_displacement;
#endif

void main() {
    vec2 x = u_window.xy + v_uv * u_window.zw;
    float far = length(x - u_center) / u_radius;
    float falloff = 1.0 - smoothstep(u_hardness, 1.0, far);
    float taken = u_amount * falloff * freedom(x);
    vec2 displacement = texture(u_displacement, v_uv).rg;
#ifdef UNDONE
    vec3 undone = texture(u_undone, v_uv).rgb;
    out_undone = vec4(undone + taken * vec3(displacement, 1.0 - undone.b), 0.0);
#else
    out_displacement = (1.0 - taken) * displacement;
#endif
}
