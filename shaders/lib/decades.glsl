// Painted thickness, decades: kept in 16 bits, 8192 steps a decade, its zero at 24576 (solver/brush/masks.py).
float decades(float texel) { return (round(texel * 65535.0) - 24576.0) / 8192.0; }
