// The velocity made free of divergence:  u - (p - p_left),  v - (p - p_up),  and 0 on closed faces.
// The pressure comes as a sum that is taken only after the differences, which keeps the digits of the smaller part.
// in:  u_velocity         MAC velocity, lengths / s
//      u_base, u_change   the two parts of pressure / h at blocks, lengths / s
//      u_left, u_up       faces of the blocks, not needed with OPEN (no solids)
// With CARRY: u_carried, gradients at MAC faces, lengths / s, and a second output.
// out: MAC velocity, lengths / s;  the mean of u_carried and of this gradient
// reads: 8
uniform sampler2D u_velocity;
uniform sampler2D u_base;
uniform sampler2D u_change;
uniform sampler2D u_left;
uniform sampler2D u_up;

in vec2 v_uv;
layout(location = 0) out vec2 out_velocity;
#ifdef CARRY
uniform sampler2D u_carried;
layout(location = 1) out vec2 out_carried;
#endif

void main() {
    // Where the cell itself, the one to the left and the one above lie in their blocks.
    vec2 cell = floor(gl_FragCoord.xy), texel = 1.0 / vec2(textureSize(u_base, 0)), block = floor(0.5 * cell);
    vec2 odd = cell - 2.0 * block, even = 1.0 - odd, at = (block + 0.5) * texel;
    vec2 left = vec2(at.x - even.x * texel.x, at.y), up = vec2(at.x, at.y - even.y * texel.y);
    vec4 here_is = vec2(even.x, odd.x).xyxy * vec2(even.y, odd.y).xxyy;
    vec4 left_is = here_is.yxwz, up_is = here_is.zwxy;
    vec4 base = texture(u_base, at), change = texture(u_change, at);
    vec2 gradient = dot(here_is, base)
                  - vec2(dot(left_is, texture(u_base, left)), dot(up_is, texture(u_base, up)));
    gradient += dot(here_is, change)
              - vec2(dot(left_is, texture(u_change, left)), dot(up_is, texture(u_change, up)));
#ifdef OPEN
    vec2 open = vec2(greaterThan(cell, vec2(0.5)));
#else
    vec2 open = vec2(dot(here_is, texture(u_left, at)), dot(here_is, texture(u_up, at)));
#endif
    out_velocity = open * (texture(u_velocity, v_uv).rg - gradient);
#ifdef CARRY
    out_carried = open * 0.5 * (texture(u_carried, v_uv).rg + gradient);
#endif
}
