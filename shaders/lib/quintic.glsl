// Weights of the six-point Lagrange quintic for samples at -2, -1, 0, 1, 2, 3 and a place f in [0, 1].
void quintic_lagrange(float f, out float weights[6]) {
    float a = f + 2.0, b = f + 1.0, c = f, d = f - 1.0, e = f - 2.0, g = f - 3.0;
    float inner = c * d * (1.0 / 12.0), middle = b * e * (1.0 / 12.0), outer = a * g * (1.0 / 24.0);
    weights[0] = -1.2 * inner * middle * g;
    weights[1] = 12.0 * outer * inner * e;
    weights[2] = -24.0 * outer * middle * d;
    weights[3] = 24.0 * outer * middle * c;
    weights[4] = -12.0 * outer * inner * b;
    weights[5] = 1.2 * inner * middle * a;
}
