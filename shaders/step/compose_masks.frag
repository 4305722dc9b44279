// The fluid's viscosity and solid cells from what the recipe sets and what has been painted over it:
//   mu = mu0 10^thickness (a painted cell of a fluid without viscosity starts from u_least, and none comes above u_most),
//   solid where frozen >= 1/2 in the cell or within two of it: looking a picture up interpolates the map, and from a
//   frozen cell reaches as far.
// u_base_viscosity: lengths^2 / s; u_base_frozen: 0-1; u_thickness: decades; u_frozen: -1 thawed ... 1 frozen.
// reads: 52
uniform sampler2D u_base_viscosity;
uniform sampler2D u_base_frozen;
uniform sampler2D u_thickness;
uniform sampler2D u_frozen;
uniform float u_least;
uniform float u_most;
in vec2 v_uv;
layout(location = 0) out float out_viscosity;
layout(location = 1) out float out_solid;

void main() {
    float base = texture(u_base_viscosity, v_uv).r, thickness = texture(u_thickness, v_uv).r;
    out_viscosity = thickness == 0.0 ? base : min(max(base, u_least) * pow(10.0, thickness), u_most);
    vec2 cell = 1.0 / vec2(textureSize(u_frozen, 0));
    float frozen = 0.0;
    for (int j = -2; j <= 2; ++j)
        for (int i = -2; i <= 2; ++i) {
            vec2 place = v_uv + vec2(i, j) * cell;
            frozen = max(frozen, texture(u_base_frozen, place).r + texture(u_frozen, place).r);
        }
    out_solid = step(0.5, frozen);
}
