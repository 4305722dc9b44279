// Widen solid cells by two: looking a picture up interpolates the map, and from a cell that is frozen reaches as far.
// u_frozen: cells, 1 = frozen.
// reads: 25
uniform sampler2D u_frozen;
in vec2 v_uv;
layout(location = 0) out float out_solid;

void main() {
    vec2 cell = 1.0 / vec2(textureSize(u_frozen, 0));
    out_solid = 0.0;
    for (int j = -2; j <= 2; ++j)
        for (int i = -2; i <= 2; ++i) out_solid = max(out_solid, texture(u_frozen, v_uv + vec2(i, j) * cell).r);
}
