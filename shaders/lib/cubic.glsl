// Weights of the four-point Lagrange cubic for samples at -1, 0, 1, 2 and a place f in [0, 1].
vec4 cubic_lagrange(float f) {
    float a = f + 1.0, b = f, c = f - 1.0, d = f - 2.0;
    return vec4(-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0);
}

// How fast those weights change with f.
vec4 cubic_slope(float f) {
    return vec4(f - 1.0 / 3.0 - 0.5 * f * f, 1.5 * f * f - 2.0 * f - 0.5, 1.0 + f - 1.5 * f * f, 0.5 * f * f - 1.0 / 6.0);
}
