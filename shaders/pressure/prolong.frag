// The coarse level's correction, interpolated to the finer one: a tensor product of 3-point stencils between linear and
// quadratic interpolation. A coarse neighbour behind a wall is replaced by its mirror image; cells that the coarse cell
// does not stand for take the mean of the coarse cells they touch.
// in:  u_coarse   pressure / h at blocks of the coarser level;  u_links   see links.frag
// With OPEN there are no solids: u_cells, the finer level's size in cells, takes the place of u_links.
// out: pressure / h at blocks of the finer level
// reads: 5
uniform sampler2D u_coarse;
uniform sampler2D u_links;
uniform vec2 u_cells;

in vec2 v_uv;
out vec4 out_pressure;

// Weights of the nearer and of the farther neighbour: (8, 0) / 32 is linear, (5, -3) / 32 quadratic interpolation.
const vec2 NEAR_FAR = vec2(5.5, -2.5) / 32.0;

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

    float here = middle.y;
    vec4 raw = vec4(left.y, right.y, middle.x, middle.z), raw_corners = vec4(left.x, right.x, left.z, right.z);
#ifdef OPEN
    vec4 side_gates = vec4(cell.x > 0.5, 2.0 * cell.x + 2.0 < u_cells.x, cell.y > 0.5, 2.0 * cell.y + 2.0 < u_cells.y);
    vec4 corner_gates = side_gates.xyxy * side_gates.zzww;
#else
    ivec3 links = ivec3(texture(u_links, v_uv).rgb * 255.0 + 0.5);
    vec4 side_gates = gates(links.g), corner_gates = gates(links.g >> 4);
#endif
    vec4 sides = mix(vec4(here), raw, side_gates);
    vec4 corners = mix(sides.xyxy + sides.zzww - here, raw_corners, corner_gates);
    left = vec3(corners.x, sides.x, corners.z);
    right = vec3(corners.y, sides.y, corners.w);
    middle = vec3(sides.z, here, sides.w);
    vec3 west = middle + NEAR_FAR.x * (left - middle) + NEAR_FAR.y * (right - middle);
    vec3 east = middle + NEAR_FAR.x * (right - middle) + NEAR_FAR.y * (left - middle);
    vec4 centre = vec2(west.y, east.y).xyxy, up = vec2(west.x, east.x).xyxy, down = vec2(west.z, east.z).xyxy;
    vec4 near = vec4(up.xy, down.xy), far = vec4(down.xy, up.xy);
    out_pressure = centre + NEAR_FAR.x * (near - centre) + NEAR_FAR.y * (far - centre);
#ifndef OPEN
    vec4 beside_gates = gates(links.b), above_gates = gates(links.b >> 4);
    vec4 orphans = (beside_gates * raw.xyxy + above_gates * raw.zzww) / max(beside_gates + above_gates, 1.0);
    out_pressure = mix(orphans, out_pressure, gates(links.r));
#endif
}
