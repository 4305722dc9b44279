// The velocity made free of divergence:  u - (p - p_left),  v - aspect (p - p_up),  and 0 on closed faces.
// in:  u_velocity         MAC velocity, lengths / s; with PACKED u_u, u_v, the same as viscosity/operator.glsl packs it
//      u_across, u_down   p - p_left and p - p_up at blocks, lengths / s
//      u_left, u_up       faces of lib/block.glsl, not needed with OPEN (no solids);  u_aspect   see there
// With CARRY: u_carried, gradients at MAC faces, lengths / s, and a second output.
// out: MAC velocity, lengths / s;  the mean of u_carried and of this gradient
// reads: 4
#ifdef PACKED
uniform sampler2D u_u;
uniform sampler2D u_v;
#else
uniform sampler2D u_velocity;
#endif
uniform sampler2D u_across;
uniform sampler2D u_down;
uniform sampler2D u_left;
uniform sampler2D u_up;
uniform float u_aspect;

in vec2 v_uv;
layout(location = 0) out vec2 out_velocity;
#ifdef CARRY
uniform sampler2D u_carried;
layout(location = 1) out vec2 out_carried;
#endif

void main() {
    vec2 cell = floor(gl_FragCoord.xy), block = floor(0.5 * cell), side = cell - 2.0 * block;
    vec2 uv = (block + 0.5) / vec2(textureSize(u_across, 0));
    vec4 mine = vec2(1.0 - side.x, side.x).xyxy * vec2(1.0 - side.y, side.y).xxyy;
#ifdef OPEN
    vec2 open = vec2(greaterThan(cell, vec2(0.5)));
#else
    vec2 open = sign(vec2(dot(texture(u_left, uv), mine), dot(texture(u_up, uv), mine)));
#endif
    vec2 gradient = vec2(dot(texture(u_across, uv), mine), u_aspect * dot(texture(u_down, uv), mine));
#ifdef PACKED
    vec2 at = (block + 1.5) / vec2(textureSize(u_u, 0)), velocity = vec2(dot(texture(u_u, at), mine), dot(texture(u_v, at), mine));
#else
    vec2 velocity = texture(u_velocity, v_uv).rg;
#endif
    out_velocity = open * (velocity - gradient);
#ifdef CARRY
    out_carried = 0.5 * open * (texture(u_carried, v_uv).rg + gradient);
#endif
}
