// The coarse level's correction, interpolated to the finer one: a tensor product of 3-point stencils between linear and
// quadratic interpolation. A coarse neighbour behind a wall is extrapolated from the opposite one, not mirrored: flow
// that runs into a wall is a line of sources in the last cells, up to which the pressure is steep. Cells that the coarse
// cell does not stand for take the mean of the coarse cells they touch.
// in:  u_coarse   pressure / h at blocks of the coarser level;  u_links   see links.frag
//      u_span   the grid's size in cells of the finer level: the last coarse cells, and their finer ones, may be narrower
// With OPEN there are no solids, and no u_links.
// out: pressure / h at blocks of the finer level
// reads: 5
uniform sampler2D u_coarse;
uniform sampler2D u_links;
uniform vec2 u_span;

in vec2 v_uv;
out vec4 out_pressure;

// Weight of linear interpolation; the rest is quadratic.
const float LINEAR = 1.0 / 6.0;

// Weights of the neighbours at -a and b of a cell whose two finer ones lie at t.
void weights(vec2 t, float a, float b, out vec2 before, out vec2 after) {
    before = mix(t * (t - b) / (a + b), max(-t, 0.0), LINEAR) / a;
    after = mix(t * (t + a) / (a + b), max(t, 0.0), LINEAR) / b;
}

vec4 gates(int bits) { return vec4(bits & 1, (bits >> 1) & 1, (bits >> 2) & 1, (bits >> 3) & 1); }
vec4 flip(vec4 block, bvec2 odd) {
    if (odd.x) block = block.yxwz;
    if (odd.y) block = block.zwxy;
    return block;
}

void main() {
    // The 3 x 3 coarse cells round this block: the four blocks on the side of this cell within its own, turned so that
    // this cell is x and its neighbour in the next block is y (beside) or z (above or below).
    vec2 cell = floor(gl_FragCoord.xy), texel = 1.0 / vec2(textureSize(u_coarse, 0)), block = floor(0.5 * cell);
    vec2 side = cell - 2.0 * block;
    bvec2 odd = greaterThan(side, vec2(0.5));
    vec2 at = (block + 0.5) * texel, next = at + (2.0 * side - 1.0) * texel;
    vec4 own = flip(texture(u_coarse, at), odd), beside = flip(texture(u_coarse, vec2(next.x, at.y)), odd);
    vec4 above = flip(texture(u_coarse, vec2(at.x, next.y)), odd), across = flip(texture(u_coarse, next), odd);
    vec3 outer = vec3(across.w, beside.y, beside.w), inner = vec3(above.w, own.y, own.w);
    vec3 middle = vec3(above.z, own.x, own.z), left = odd.x ? inner : outer, right = odd.x ? outer : inner;
    if (odd.y) { left = left.zyx; middle = middle.zyx; right = right.zyx; }

    // In finer cells: where the two finer cells lie, and how far it is to the coarse centres before and after.
    vec2 rest = 0.5 * u_span - cell;
    vec2 width = min(rest, 1.0), start = -max(width - 0.5, 0.0);
    vec2 before = 1.0 + width, after = mix(before, min(rest, 2.0), greaterThan(rest, vec2(1.0)));
    vec2 left_weights, right_weights, up_weights, down_weights;
    weights(vec2(start.x, 0.5), before.x, after.x, left_weights, right_weights);
    weights(vec2(start.y, 0.5), before.y, after.y, up_weights, down_weights);

    float here = middle.y;
    vec4 raw = vec4(left.y, right.y, middle.x, middle.z), raw_corners = vec4(left.x, right.x, left.z, right.z);
#ifdef OPEN
    vec4 side_gates = vec4(cell.x > 0.5, rest.x > 1.0, cell.y > 0.5, rest.y > 1.0);
    vec4 corner_gates = side_gates.xyxy * side_gates.zzww;
#else
    ivec3 links = ivec3(texture(u_links, v_uv).rgb * 255.0 + 0.5);
    vec4 side_gates = gates(links.g), corner_gates = gates(links.g >> 4);
#endif
    vec4 steps = side_gates * (raw - here);
    vec4 sides = here + steps - (1.0 - side_gates) * steps.yxwz;
    vec4 corners = mix(sides.xyxy + sides.zzww - here, raw_corners, corner_gates);
    left = vec3(corners.x, sides.x, corners.z);
    right = vec3(corners.y, sides.y, corners.w);
    middle = vec3(sides.z, here, sides.w);
    vec3 west = middle + left_weights.x * (left - middle) + right_weights.x * (right - middle);
    vec3 east = middle + left_weights.y * (left - middle) + right_weights.y * (right - middle);
    vec4 centre = vec2(west.y, east.y).xyxy, up = vec2(west.x, east.x).xyxy, down = vec2(west.z, east.z).xyxy;
    out_pressure = centre + up_weights.xxyy * (up - centre) + down_weights.xxyy * (down - centre);
#ifndef OPEN
    vec4 beside_gates = gates(links.b), above_gates = gates(links.b >> 4);
    vec4 orphans = (beside_gates * raw.xyxy + above_gates * raw.zzww) / max(beside_gates + above_gates, 1.0);
    out_pressure = mix(orphans, out_pressure, gates(links.r));
#endif
}
