// Which faces are open, texel by texel as in operator.glsl: 1 for u, plus 2 for v.
uniform sampler2D u_open; // 8 bits

vec2 own_texel() { return floor(gl_FragCoord.xy) - 1.0; }
vec4 openness(vec2 texel) { return floor(255.0 * texture(u_open, (texel + 1.5) / vec2(textureSize(u_open, 0))) + 0.5); }
vec4 open_u(vec2 texel) { return mod(openness(texel), 2.0); }
vec4 open_v(vec2 texel) { return step(1.5, openness(texel)); }
