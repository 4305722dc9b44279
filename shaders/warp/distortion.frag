// Distortion: how the map x + D(x) stretches and folds at every cell, by central differences, one-sided at the edges.
// u_displacement (D): cell centres, longer sides; u_spacing: distances of the centres, longer sides.
// largest: (-det J, det J, |D|) with J = I + grad D, to be reduced to the largest of each;
// total: (1 where det J <= 0, |D|, |det J - 1|), to be reduced to their sums.
// reads: 5
uniform sampler2D u_displacement;
uniform vec2 u_spacing;
layout(location = 0) out vec4 out_largest;
layout(location = 1) out vec4 out_total;

vec2 read(ivec2 place) { return texelFetch(u_displacement, place, 0).rg; }

void main() {
    ivec2 here = ivec2(gl_FragCoord.xy), last = textureSize(u_displacement, 0) - 1;
    ivec2 before = max(here - 1, 0), after = min(here + 1, last);
    vec2 apart = u_spacing * vec2(after - before);
    vec2 dx = (read(ivec2(after.x, here.y)) - read(ivec2(before.x, here.y))) / apart.x;
    vec2 dy = (read(ivec2(here.x, after.y)) - read(ivec2(here.x, before.y))) / apart.y;
    float determinant = (1.0 + dx.x) * (1.0 + dy.y) - dx.y * dy.x, far = length(read(here));
    out_largest = vec4(-determinant, determinant, far, 0.0);
    out_total = vec4(determinant <= 0.0 ? 1.0 : 0.0, far, abs(determinant - 1.0), 0.0);
}
