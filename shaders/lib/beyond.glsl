// What lies beyond a picture, by EDGES: 0 transparent, 1 black, 2 as at its edge (the sampler clamps), 3 mirrored, 4 repeated.
#ifndef EDGES
#define EDGES 2
#endif
float inside(vec2 place) { return float(all(greaterThanEqual(place, vec2(0.0))) && all(lessThanEqual(place, vec2(1.0)))); }

// Where in the picture that is looked up.
vec2 repeated(vec2 place) {
#if EDGES == 3
    return 1.0 - abs(mod(place, 2.0) - 1.0);
#elif EDGES == 4
    return fract(place);
#else
    return place;
#endif
}

// What was found there, or lies there instead; premultiplied.
vec4 bounded(vec4 colour, vec2 place) {
#if EDGES == 0
    return colour * inside(place);
#elif EDGES == 1
    return inside(place) < 0.5 ? vec4(0.0, 0.0, 0.0, 1.0) : colour;
#else
    return colour;
#endif
}
