// How far the fluid at a node lets a brush lead it: 1 where it is no thicker than at the brush's tip, less in proportion to
// how much thicker it is; the least of the four cells around. And the leeway that frozen cells leave a brush: less the more
// of it lies on them, for all of it alike. Were it less beside them only, what the brush moves would flow back there through
// a single cell, many times faster than the brush, and tear the map. Both 1 unless YIELDING. Include after brush.glsl.
#ifdef YIELDING
uniform sampler2D u_viscosity; // lengths^2 / s
uniform sampler2D u_solid;

const int RAYS = 8;
const float CROWDED = 0.25; // part of the brush on frozen cells from which on nothing is led

float leeway() {
    vec2 size = vec2(textureSize(u_solid, 0));
    float sum = 0.0;
    for (int k = 0; k < RAYS; ++k) {
        float angle = 6.2831853 * float(k) / float(RAYS);
        vec2 way = vec2(cos(angle), sin(angle)) * u_radius;
        for (int j = 1; j <= 3; ++j)
            sum += step(0.5, texture(u_solid, (u_segment.zw + way * float(j) / 3.0) * max(size.x, size.y) / size).r);
    }
    return 1.0 - smoothstep(0.0, CROWDED, sum / float(3 * RAYS));
}

float yielding(vec2 node, float tip_viscosity) {
    vec2 texel = 1.0 / vec2(textureSize(u_viscosity, 0));
    float least = 1.0;
    for (int k = 0; k < 4; ++k) {
        vec2 place = (node + vec2(k & 1, k >> 1) - 0.5) * texel;
        float thicker = max(texture(u_viscosity, place).r, 1e-9) / max(tip_viscosity, 1e-9);
        least = min(least, 1.0 / max(thicker, 1.0));
    }
    return least;
}
#else
float leeway() { return 1.0; }
float yielding(vec2 node, float tip_viscosity) { return 1.0; }
#endif
