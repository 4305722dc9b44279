// How large the footprint of a pixel is: how far apart its samples lie, 0-1 of what covers it, where the map takes its
// sides to `along_x` and `along_y`, in pixels of the picture. None where it only shifts and turns or enlarges: one sample
// is enough there and keeps the picture as sharp as it is. Between that and what shrinks or distorts they move apart, so
// that no seam shows.
float footprint(vec2 along_x, vec2 along_y) {
    float xx = dot(along_x, along_x), yy = dot(along_y, along_y), xy = dot(along_x, along_y), difference = 0.5 * (xx - yy);
    float largest = sqrt(0.5 * (xx + yy) + sqrt(difference * difference + xy * xy));  // singular value
    float strain = abs(sqrt(xx) - 1.0) + abs(sqrt(yy) - 1.0) + abs(xy);
    return smoothstep(0.0, 0.2, strain) * smoothstep(0.75, 1.0, largest);
}
