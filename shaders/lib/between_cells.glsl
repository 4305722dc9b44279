// What is read between four cells, so that it goes over from one to the next: by the cell that a place lies in it would
// change by steps, and on the side of two cells be the one's or the other's by rounding.
struct Around {
    vec4 uv;   // of the first cell and of the last
    vec2 part; // of the way from the first to the last
};

// at: cells, (0, 0) the grid's corner; the cells at the edge go on beyond it.
Around around(vec2 at, vec2 size) {
    vec2 inside = clamp(at - 0.5, vec2(0.0), size - 1.0), low = floor(inside);
    return Around(vec4(low + 0.5, min(low + 1.5, size - 0.5)) / size.xyxy, inside - low);
}

// 4 reads.
vec4 cells(sampler2D scalar, vec4 uv) {
    return vec4(texture(scalar, uv.xy).r, texture(scalar, uv.zy).r, texture(scalar, uv.xw).r, texture(scalar, uv.zw).r);
}

float harmonic(float a, float b, float part) { return a * (b / (b + part * (a - b))); } // a itself where both are alike

// Viscosity (lengths^2 / s; at least 1e-9), harmonic as at nodes (solver/README.md). 4 reads.
float viscosity_at(sampler2D viscosity, vec2 at) {
    Around place = around(at, vec2(textureSize(viscosity, 0)));
    vec4 four = max(cells(viscosity, place.uv), 1e-9);
    return harmonic(harmonic(four.x, four.y, place.part.x), harmonic(four.z, four.w, place.part.x), place.part.y);
}
