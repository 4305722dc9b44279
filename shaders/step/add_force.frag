// Add force, its first part: w1 = w0 - g, to which the forces are added (equation S2; paper section 3.2, first stage).
// u_velocity (w0), u_carried (g, half the last pressure gradient): MAC faces, lengths / s.
// reads: 2
uniform sampler2D u_velocity;
uniform sampler2D u_carried;
in vec2 v_uv;
layout(location = 0) out vec2 out_velocity;

void main() {
    out_velocity = texture(u_velocity, v_uv).rg - texture(u_carried, v_uv).rg;
}
