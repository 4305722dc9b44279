// Carry: what flows through MAC faces, the fluid's velocity times their open part; with LOCAL that is given, and a local
// motion through them is added.
// u_velocity, u_local: MAC faces, lengths / s; u_solid: cells, how far they are closed.
// reads: 4, and 5 with LOCAL
uniform sampler2D u_velocity;
uniform sampler2D u_local;
uniform sampler2D u_solid;
in vec2 v_uv;
layout(location = 0) out vec2 out_velocity;

void main() {
    vec2 texel = 1.0 / vec2(textureSize(u_solid, 0));
    float here = texture(u_solid, v_uv).r;
    vec2 before = vec2(texture(u_solid, v_uv - vec2(texel.x, 0.0)).r, texture(u_solid, v_uv - vec2(0.0, texel.y)).r);
    vec2 open = 1.0 - max(vec2(here), before);
#ifdef LOCAL
    out_velocity = texture(u_velocity, v_uv).rg + open * texture(u_local, v_uv).rg;
#else
    out_velocity = open * texture(u_velocity, v_uv).rg;
#endif
}
