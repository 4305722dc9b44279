// Weights of the six-point Lagrange quintic for samples at -2, -1, 0, 1, 2, 3 and a place f in [0, 1].
void quintic_lagrange(float f, out float weights[6]) {
    float a = f + 2.0, b = f + 1.0, c = f, d = f - 1.0, e = f - 2.0, g = f - 3.0;
    weights[0] = -b * c * d * e * g / 120.0;
    weights[1] = a * c * d * e * g / 24.0;
    weights[2] = -a * b * d * e * g / 12.0;
    weights[3] = a * b * c * e * g / 12.0;
    weights[4] = -a * b * c * d * g / 24.0;
    weights[5] = a * b * c * d * e / 120.0;
}
