// Carry: the velocity on MAC faces that carries the picture: the fluid's, and a local motion but on the faces of solids.
// u_velocity, u_local: MAC faces, lengths / s; u_solid: cells.
// reads: 5
uniform sampler2D u_velocity;
uniform sampler2D u_local;
uniform sampler2D u_solid;
in vec2 v_uv;
layout(location = 0) out vec2 out_velocity;

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_solid, 0));
    float here = texture(u_solid, v_uv).r;
    vec2 before = vec2(texture(u_solid, v_uv - vec2(texel.x, 0.0)).r, texture(u_solid, v_uv - vec2(0.0, texel.y)).r);
    vec2 open = vec2(lessThan(max(vec2(here), before), vec2(0.5)));
    out_velocity = texture(u_velocity, v_uv).rg + open * texture(u_local, v_uv).rg;
}
