// Viscosity attenuation: how far the fluid at a node lets a brush lead it, 1 where it is no thicker than at the brush's
// tip, less in proportion to how much thicker it is; the least of the four cells around. And the obstruction factor of
// all of an image of the brush, from obstruct.frag. Both 1 unless ATTENUATED.
#ifdef ATTENUATED
uniform sampler2D u_viscosity; // lengths^2 / s
uniform sampler2D u_obstruction;

float unobstructed(ivec2 image) { return texelFetch(u_obstruction, image, 0).r; }

float attenuation(vec2 node, float tip_viscosity) {
    vec2 texel = 1.0 / vec2(textureSize(u_viscosity, 0));
    float least = 1.0;
    for (int k = 0; k < 4; ++k) {
        vec2 place = (node + vec2(k & 1, k >> 1) - 0.5) * texel;
        float thicker = max(texture(u_viscosity, place).r, 1e-9) / max(tip_viscosity, 1e-9);
        least = min(least, 1.0 / max(thicker, 1.0));
    }
    return least;
}
#else
float unobstructed(ivec2 image) { return 1.0; }
float attenuation(vec2 node, float tip_viscosity) { return 1.0; }
#endif
