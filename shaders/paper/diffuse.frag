// One Jacobi sweep of the paper's Appendix A, its misprints mended: the factor is 1 / (1 + 4 mu dt / h^2), "/ n" is "/ h",
// and the stray "- 4 u^n" of its first line is gone.
// u_velocity: the iterate; u_before: the right-hand side w2; u_viscosity: lengths^2 / s; u_dt_over_h2: dt / h^2.
// Solid cells do not move, which the paper does not have.
// reads: 16
#include "paper/collocated.glsl"
uniform sampler2D u_velocity;
uniform sampler2D u_before;
uniform sampler2D u_viscosity;
uniform sampler2D u_solid;
uniform float u_dt_over_h2;
layout(location = 0) out vec2 out_velocity;

void main() {
    ivec2 c = ivec2(gl_FragCoord.xy);
    const ivec2 x = ivec2(1, 0), y = ivec2(0, 1);
    vec2 left = velocity_at(u_velocity, c - x), right = velocity_at(u_velocity, c + x);
    vec2 above = velocity_at(u_velocity, c - y), below = velocity_at(u_velocity, c + y);
    float k = u_dt_over_h2 * texelFetch(u_viscosity, c, 0).r;
    // dt mu_x / h and dt mu_y / h, by central differences.
    float kx = 0.5 * u_dt_over_h2 * (scalar_at(u_viscosity, c + x) - scalar_at(u_viscosity, c - x));
    float ky = 0.5 * u_dt_over_h2 * (scalar_at(u_viscosity, c + y) - scalar_at(u_viscosity, c - y));
    vec2 sum = left + right + above + below;
    float shear = below.x - above.x + right.y - left.y;
    vec2 result = texelFetch(u_before, c, 0).rg + k * sum
        + vec2(kx * (right.x - left.x) + 0.5 * ky * shear, ky * (below.y - above.y) + 0.5 * kx * shear);
    out_velocity = texelFetch(u_solid, c, 0).r > 0.5 ? vec2(0.0) : result / (1.0 + 4.0 * k);
}
