// Coefficients: the viscous step's K on the finest grid, see cells.glsl.
// u_viscosity: cells, lengths^2 / s; u_solid: 1 = solid; u_dt_over_h2: dt / h^2, s / lengths^2.
// K = 2 dt mu / h^2 in cells, dt mu_node / h^2 at nodes, mu_node the harmonic mean of the fluid cells that meet there.
// reads: 8
uniform sampler2D u_viscosity;
uniform sampler2D u_solid;
uniform float u_dt_over_h2;
layout(location = 0) out vec4 out_cell;

// So that a cell of no viscosity is still told from no fluid.
const float least = 1e-20;

// dt mu / h^2 of the cell c, 0 where no fluid is.
float viscosity(ivec2 c) {
    ivec2 size = textureSize(u_viscosity, 0);
    if (any(lessThan(c, ivec2(0))) || any(greaterThanEqual(c, size)) || texelFetch(u_solid, c, 0).r > 0.5) return 0.0;
    return max(u_dt_over_h2 * texelFetch(u_viscosity, c, 0).r, least);
}

void main() {
    ivec2 c = ivec2(gl_FragCoord.xy);
    float here = viscosity(c), left = viscosity(c - ivec2(1, 0)), above = viscosity(c - ivec2(0, 1));
    vec4 around = vec4(here, left, above, viscosity(c - 1));
    vec4 fluid = vec4(greaterThan(around, vec4(0.0)));
    float resistance = dot(fluid, 1.0 / max(around, least));
    float node = resistance > 0.0 ? dot(fluid, vec4(1.0)) / resistance : 0.0;
    out_cell = vec4(2.0 * here, 2.0 * here, node, fluid.x * (fluid.y + 2.0 * fluid.z));
}
