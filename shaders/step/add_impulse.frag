// Add an impulse: dt f, drawn with additive blending over what it is added to.
// u_force: MAC faces, lengths / s^2; u_impulse: the force's time law integrated over the tick, seconds.
// reads: 1
uniform sampler2D u_force;
uniform float u_impulse;
in vec2 v_uv;
layout(location = 0) out vec2 out_velocity;

void main() {
    out_velocity = u_impulse * texture(u_force, v_uv).rg;
}
