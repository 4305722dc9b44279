// One Jacobi sweep of (1 - dt kappa lap) phi = phi0, nothing flowing through the edges (equation (5), second term).
// u_density: the iterate; u_before: phi0; u_k: dt kappa / h^2 of the density's grid, by columns and by rows.
// reads: 6
uniform sampler2D u_density;
uniform sampler2D u_before;
uniform vec2 u_k;
in vec2 v_uv;
layout(location = 0) out vec4 out_density;

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_density, 0));
    vec4 beside = texture(u_density, v_uv - vec2(texel.x, 0.0)) + texture(u_density, v_uv + vec2(texel.x, 0.0));
    vec4 above_below = texture(u_density, v_uv - vec2(0.0, texel.y)) + texture(u_density, v_uv + vec2(0.0, texel.y));
    out_density = (texture(u_before, v_uv) + u_k.x * beside + u_k.y * above_below) / (1.0 + 2.0 * u_k.x + 2.0 * u_k.y);
}
