// Half the gradient of the whole pressure, for the next step's start: g = (w3 - w4 + g_before) / 2.
// The projection found w3 - w4, on top of the half g_before that the step had begun with.
// u_before_projection (w3), u_velocity (w4), u_carried (g_before): MAC faces, lengths / s.
// reads: 3
uniform sampler2D u_before_projection;
uniform sampler2D u_velocity;
uniform sampler2D u_carried;
in vec2 v_uv;
layout(location = 0) out vec2 out_carried;

void main() {
    out_carried = 0.5 * (texture(u_before_projection, v_uv) - texture(u_velocity, v_uv) + texture(u_carried, v_uv)).rg;
}
