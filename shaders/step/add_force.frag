// Add force: w1 = w0 - g + dt f (equation S2; paper section 3.2, first stage).
// u_velocity (w0), u_carried (g, half the last pressure gradient): MAC faces, lengths / s. With FORCE: u_force, MAC faces,
// lengths / s^2, and u_impulse, the force's time law integrated over the tick, seconds; for more see add_impulse.frag.
// reads: 2, and 3 with FORCE
uniform sampler2D u_velocity;
uniform sampler2D u_carried;
#ifdef FORCE
uniform sampler2D u_force;
uniform float u_impulse;
#endif
in vec2 v_uv;
layout(location = 0) out vec2 out_velocity;

void main() {
    out_velocity = texture(u_velocity, v_uv).rg - texture(u_carried, v_uv).rg;
#ifdef FORCE
    out_velocity += u_impulse * texture(u_force, v_uv).rg;
#endif
}
