// Widen solid cells by two: there the map goes over from what it holds into what flows.
// u_frozen: cells, 1 where something in them is frozen.
// reads: 25
uniform sampler2D u_frozen;
in vec2 v_uv;
layout(location = 0) out float out_solid;

void main() {
    vec2 cell = 1.0 / vec2(textureSize(u_frozen, 0));
    out_solid = 0.0;
    for (int j = -2; j <= 2; ++j)
        for (int i = -2; i <= 2; ++i) out_solid = max(out_solid, sign(texture(u_frozen, v_uv + vec2(i, j) * cell).r));
}
