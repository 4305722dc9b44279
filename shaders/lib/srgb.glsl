// The sRGB transfer curve (IEC 61966-2-1), code values 0-1.
vec3 srgb_to_linear(vec3 code) {
    return mix(code / 12.92, pow((code + 0.055) / 1.055, vec3(2.4)), vec3(greaterThan(code, vec3(0.04045))));
}
vec3 linear_to_srgb(vec3 light) {
    light = max(light, vec3(0.0));
    return mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, vec3(greaterThan(light, vec3(0.0031308))));
}
