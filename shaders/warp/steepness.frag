// Steepness: the largest |grad D|^2 at the corners, each shared by four cells, of a block, by differences of their means.
// u_displacement (D): cell centres, longer sides; u_spacing: distances of the centres, longer sides; u_side: corners along
// a block. Define TILE to look at no corner between two tiles of so many cells a side.
// Define FACES for a velocity on MAC faces: the strains of the cells by their mean too, the shears as they are at the corner.
// Then a mirrored flow has the same one, as differences of means of faces would not.
// Define SCALING for how near scaling D by anything from 0 to 1 comes to a fold: -min det(1 + a grad D) over all a, of the
// smaller one of 1 and det(1 + grad D); -1 where that folds, and where nothing is lost.
// reads: 144, with FACES 232
uniform sampler2D u_displacement;
uniform vec2 u_spacing;
uniform float u_side;
layout(location = 0) out float out_steepness;

// slope: how much D changes along x, and along y.
#ifdef SCALING
const float LEAST = -1.0;
float measure(vec4 slope) {
    float trace = slope.x + slope.w, square = slope.x * slope.w - slope.y * slope.z;
    float whole = 1.0 + trace + square, least = min(whole, 1.0);
    // 1 + a trace + a^2 square is least inside only if it bends upwards there.
    if (square > 0.0 && -trace > 0.0 && -trace < 2.0 * square) least = 1.0 - trace * trace / (4.0 * square);
    return whole > 0.0 ? -least / min(whole, 1.0) : -1.0;
}
#else
const float LEAST = 0.0;
float measure(vec4 slope) { return dot(slope, slope); }
#endif

void main() {
    vec2 size = vec2(textureSize(u_displacement, 0)), texel = 1.0 / size;
    vec2 first = u_side * floor(gl_FragCoord.xy) + 0.5, end = min(first + u_side, size - 1.0);
#ifdef TILE
    end = min(end, float(TILE) * (floor(first / float(TILE)) + 1.0) - 1.0);
#endif
    out_steepness = LEAST;
    for (float y = first.y; y < end.y; ++y) {
        vec2 upper_left = texture(u_displacement, vec2(first.x, y) * texel).rg;
        vec2 lower_left = texture(u_displacement, vec2(first.x, y + 1.0) * texel).rg;
#ifdef FACES
        vec2 upper_middle = texture(u_displacement, vec2(first.x + 1.0, y) * texel).rg;
        vec2 lower_middle = texture(u_displacement, vec2(first.x + 1.0, y + 1.0) * texel).rg;
        float below = float(y + 2.0 < size.y), below_left = below * texture(u_displacement, vec2(first.x, y + 2.0) * texel).g;
#endif
        for (float x = first.x; x < end.x; ++x) {
#ifdef FACES
            vec2 upper_right = texture(u_displacement, vec2(x + 2.0, y) * texel).rg;
            vec2 lower_right = texture(u_displacement, vec2(x + 2.0, y + 1.0) * texel).rg;
            float below_middle = below * texture(u_displacement, vec2(x + 1.0, y + 2.0) * texel).g;
            // Beyond the last faces lie those of the far walls, at rest.
            float right = float(x + 2.0 < size.x);
            float u_across = 0.25 * (right * (upper_right.x + lower_right.x) - upper_left.x - lower_left.x);
            float v_down = 0.25 * (below_left + below_middle - upper_left.y - upper_middle.y);
            vec4 slope = vec4(u_across, lower_middle.y - lower_left.y, lower_middle.x - upper_middle.x, v_down) / u_spacing.xxyy;
            upper_left = upper_middle;
            lower_left = lower_middle;
            upper_middle = upper_right;
            lower_middle = lower_right;
            below_left = below_middle;
#else
            vec2 upper_right = texture(u_displacement, vec2(x + 1.0, y) * texel).rg;
            vec2 lower_right = texture(u_displacement, vec2(x + 1.0, y + 1.0) * texel).rg;
            vec2 across = upper_right + lower_right - upper_left - lower_left;
            vec2 down = lower_left + lower_right - upper_left - upper_right;
            vec4 slope = 0.5 * vec4(across, down) / u_spacing.xxyy;
            upper_left = upper_right;
            lower_left = lower_right;
#endif
            out_steepness = max(out_steepness, measure(slope));
        }
    }
}
