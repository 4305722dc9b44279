// A velocity in blocks laid back out on the MAC grid.
// in:  u_u, u_v   at blocks, lengths / s
// out: MAC velocity, lengths / s
// reads: 2
uniform sampler2D u_u;
uniform sampler2D u_v;

out vec2 out_velocity;

void main() {
    vec2 cell = floor(gl_FragCoord.xy), block = floor(0.5 * cell), side = cell - 2.0 * block;
    vec2 uv = (block + 0.5) / vec2(textureSize(u_u, 0));
    vec4 mine = vec4(1.0 - side.x, side.x, 1.0 - side.x, side.x) * vec4(1.0 - side.yy, side.yy);
    out_velocity = vec2(dot(texture(u_u, uv), mine), dot(texture(u_v, uv), mine));
}
