// The paper's grid: velocity and viscosity at cell centres. Beyond an edge the normal velocity is odd and the tangential
// even (no-slip: both odd), the viscosity and the pressure even; all of it written here and nowhere else.

ivec2 mirrored(ivec2 c, ivec2 size) {
    return ivec2(c.x < 0 ? -1 - c.x : (c.x >= size.x ? 2 * size.x - 1 - c.x : c.x),
                 c.y < 0 ? -1 - c.y : (c.y >= size.y ? 2 * size.y - 1 - c.y : c.y));
}

vec2 velocity_at(sampler2D velocity, ivec2 c) {
    ivec2 size = textureSize(velocity, 0), inside = mirrored(c, size);
    vec2 v = texelFetch(velocity, inside, 0).rg;
    if (inside.x != c.x) v.x = -v.x;
    if (inside.y != c.y) v.y = -v.y;
#ifdef NO_SLIP
    if (inside.x != c.x) v.y = -v.y;
    if (inside.y != c.y) v.x = -v.x;
#endif
    return v;
}

float scalar_at(sampler2D field, ivec2 c) {
    return texelFetch(field, mirrored(c, textureSize(field, 0)), 0).r;
}

// Bilinear velocity at p, in cells, kept in the grid.
vec2 velocity_near(sampler2D velocity, vec2 p) {
    vec2 q = clamp(p, vec2(0.0), vec2(textureSize(velocity, 0))) - 0.5, f = fract(q);
    ivec2 c = ivec2(floor(q));
    return mix(mix(velocity_at(velocity, c), velocity_at(velocity, c + ivec2(1, 0)), f.x),
               mix(velocity_at(velocity, c + ivec2(0, 1)), velocity_at(velocity, c + ivec2(1, 1)), f.x), f.y);
}
