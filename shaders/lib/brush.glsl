// The shape of a brush drawn along a segment from a to b (a.xy, b.xy): everything in lengths.
uniform float u_radius;
uniform float u_hardness; // 0 soft, 1 hard

// The point of the segment nearest to x.
vec2 brush_nearest(vec4 segment, vec2 x) {
    vec2 a = segment.xy, along = segment.zw - a;
    float length2 = dot(along, along);
    return a + along * (length2 > 0.0 ? clamp(dot(x - a, along) / length2, 0.0, 1.0) : 0.0);
}

// 1 inside the hard core, falling smoothly (twice differentiable) to 0 at the radius.
float brush_falloff(float distance_to_path) {
    float core = 0.9 * u_hardness * u_radius;
    float q = clamp((distance_to_path - core) / (u_radius - core), 0.0, 1.0), w = 1.0 - q * q;
    return w * w * w;
}

float brush_weight(vec4 segment, vec2 x) { return brush_falloff(distance(x, brush_nearest(segment, x))); }

// The flow of a soft push at r, in radii: curl of its falloff times direction x r.
vec2 brush_flow(vec2 r, vec2 direction) {
    float w = max(1.0 - dot(r, r), 0.0);
    return w * w * (w * direction + 6.0 * (direction.x * r.y - direction.y * r.x) * vec2(-r.y, r.x));
}
