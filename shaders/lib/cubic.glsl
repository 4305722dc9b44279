// Weights of the four-point Lagrange cubic for samples at -1, 0, 1, 2 and a place f in [0, 1].
vec4 cubic_lagrange(float f) {
    float inner = f * (f - 1.0), outer = (f + 1.0) * (f - 2.0);
    return vec4((2.0 - f) * inner, 3.0 * (f - 1.0) * outer, -3.0 * f * outer, (f + 1.0) * inner) * (1.0 / 6.0);
}

// How fast those weights change with f.
vec4 cubic_slope(float f) {
    return vec4(f - 1.0 / 3.0 - 0.5 * f * f, 1.5 * f * f - 2.0 * f - 0.5, 1.0 + f - 1.5 * f * f, 0.5 * f * f - 1.0 / 6.0);
}
