// Reading a displacement between its texels, at position p (in texels, (0,0) the top left corner), by Lagrange
// polynomials. At the edges the outermost texels are taken, so that the map goes on beyond them as the same polynomial.
// `walled` is 1 where nothing crosses the texture's edges, else 0: see to_edges.
// texture() with nearest filtering: exact at texel centres, and cheaper than texelFetch in software.
#include "lib/cubic.glsl"
#include "lib/quintic.glsl"

// A spline times a weight that is zero on an edge is zero there too (Kantorovich and Krylov), as what crosses it is: the
// values, that weight's inverse at their places, times the weight at p. It is the distance to the edge, where that is one of
// four texels; a polynomial alone goes on to some value beyond, is cut off there, and from remap to remap folds the last texels.
// The outermost of four are always as far from it, so nothing is divided.
const vec4 FROM_EDGE = 1.0 / vec4(0.5, 1.5, 2.5, 3.5);

vec4 to_edges(float p, float cell, float count, float walled) {
    vec4 near = mix(vec4(1.0), p * FROM_EDGE, walled * float(cell <= 1.0));
    return near * mix(vec4(1.0), (count - p) * FROM_EDGE.wzyx, walled * float(cell >= count - 3.0));
}

// How much that changes with p.
vec4 to_edges_slope(float p, float cell, float count, float walled) {
    vec4 at = cell + vec4(-0.5, 0.5, 1.5, 2.5), far = count - at;
    float first = walled * float(cell <= 1.0), last = walled * float(cell >= count - 3.0);
    return first / at * mix(vec4(1.0), (count - p) / far, last) - last / far * mix(vec4(1.0), p / at, first);
}

// Between the four next texels. 4 reads.
vec4 linear_texels(sampler2D displacement, vec2 p) {
    vec2 texel = 1.0 / vec2(textureSize(displacement, 0)), cell = floor(p - 0.5), f = p - 0.5 - cell;
    vec2 low = (cell + 0.5) * texel, high = low + texel;
    return mix(mix(texture(displacement, low), texture(displacement, vec2(high.x, low.y)), f.x),
               mix(texture(displacement, vec2(low.x, high.y)), texture(displacement, high), f.x), f.y);
}

// Four-point cubic along x blended with one along y (the Boolean sum CL + LC - LL of the cubic C and the linear L), which
// needs no corners: fourth order like the product of both, and on a map as exact. What is no displacement, the third and
// fourth component, knows no edges. 12 reads.
vec4 cubic_texels(sampler2D displacement, vec2 p, float walled) {
    vec2 size = vec2(textureSize(displacement, 0)), texel = 1.0 / size;
    vec2 cell = clamp(floor(p - 0.5), vec2(1.0), size - 3.0), f = p - 0.5 - cell;
    vec4 cx = cubic_lagrange(f.x), cy = cubic_lagrange(f.y);
    vec4 ex = to_edges(p.x, cell.x, size.x, walled), ey = to_edges(p.y, cell.y, size.y, walled);
    vec2 lx = vec2(1.0 - f.x, f.x), ly = vec2(1.0 - f.y, f.y), bend = cx.yz - lx;
    vec4 x = (cell.x + vec4(-0.5, 0.5, 1.5, 2.5)) * texel.x, y = (cell.y + vec4(-0.5, 0.5, 1.5, 2.5)) * texel.y;
#define AT(i, j) texture(displacement, vec2(x[i], y[j])) * vec4(ex[i], ey[j], 1.0, 1.0)
    return (cy.y * lx.x + ly.x * bend.x) * AT(1, 1) + (cy.y * lx.y + ly.x * bend.y) * AT(2, 1)
         + (cy.z * lx.x + ly.y * bend.x) * AT(1, 2) + (cy.z * lx.y + ly.y * bend.y) * AT(2, 2)
         + ly.x * (cx.x * AT(0, 1) + cx.w * AT(3, 1)) + ly.y * (cx.x * AT(0, 2) + cx.w * AT(3, 2))
         + cy.x * (lx.x * AT(1, 0) + lx.y * AT(2, 0)) + cy.w * (lx.x * AT(1, 3) + lx.y * AT(2, 3));
#undef AT
}

vec2 cubic_displacement(sampler2D displacement, vec2 p, float walled) { return cubic_texels(displacement, p, walled).rg; }

// The same with its own derivatives along x (first column) and y, to a texel: far from the middle of the four points, as in
// a picture's corner, those of another cubic would not tell of its folds. 16 reads.
vec4 cubic_texels(sampler2D displacement, vec2 p, float walled, out mat2x4 slope) {
    vec2 size = vec2(textureSize(displacement, 0)), texel = 1.0 / size;
    vec2 cell = clamp(floor(p - 0.5), vec2(1.0), size - 3.0), f = p - 0.5 - cell;
    vec4 lx = vec4(0.0, 1.0 - f.x, f.x, 0.0), ly = vec4(0.0, 1.0 - f.y, f.y, 0.0), along = vec4(0.0, -1.0, 1.0, 0.0);
    vec4 cx = cubic_lagrange(f.x), sx = cubic_slope(f.x), by = cubic_lagrange(f.y) - ly, sy = cubic_slope(f.y) - along;
    vec4 ex = to_edges(p.x, cell.x, size.x, walled), ey = to_edges(p.y, cell.y, size.y, walled);
    vec4 dx = to_edges_slope(p.x, cell.x, size.x, walled), dy = to_edges_slope(p.y, cell.y, size.y, walled);
    vec4 x = (cell.x + vec4(-0.5, 0.5, 1.5, 2.5)) * texel.x, y = (cell.y + vec4(-0.5, 0.5, 1.5, 2.5)) * texel.y;
    vec4 sum = vec4(0.0);
    slope = mat2x4(0.0);
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
            vec4 read = texture(displacement, vec2(x[i], y[j])), value = read * vec4(ex[i], ey[j], 1.0, 1.0);
            float weight = cx[i] * ly[j] + lx[i] * by[j];
            sum += weight * value;
            slope[0] += (sx[i] * ly[j] + along[i] * by[j]) * value + vec4(weight * dx[i] * read.x, 0.0, 0.0, 0.0);
            slope[1] += (cx[i] * along[j] + lx[i] * sy[j]) * value + vec4(0.0, weight * dy[j] * read.y, 0.0, 0.0);
        }
    return sum;
}

vec2 cubic_displacement(sampler2D displacement, vec2 p, float walled, out mat2 slope) {
    mat2x4 slopes;
    vec2 sum = cubic_texels(displacement, p, walled, slopes).rg;
    slope = mat2(slopes[0].rg, slopes[1].rg);
    return sum;
}

// The cubic at the corners of a rectangle as far across as `side`, in texels, from p on, where it is the polynomial at p:
// top left and right, bottom left and right. 12 reads.
void cubic_corners(sampler2D displacement, vec2 p, vec2 side, float walled, out vec2 corners[4]) {
    vec2 size = vec2(textureSize(displacement, 0)), texel = 1.0 / size;
    vec2 cell = clamp(floor(p - 0.5), vec2(1.0), size - 3.0), f = p - 0.5 - cell;
    vec4 x = (cell.x + vec4(-0.5, 0.5, 1.5, 2.5)) * texel.x, y = (cell.y + vec4(-0.5, 0.5, 1.5, 2.5)) * texel.y;
    vec4 cx[2], lx[2], ex[2], by[2], ly[2], ey[2];
    for (int k = 0; k < 2; ++k) {
        vec2 at = f + float(k) * side, there = p + float(k) * side;
        cx[k] = cubic_lagrange(at.x);
        lx[k] = vec4(0.0, 1.0 - at.x, at.x, 0.0);
        ly[k] = vec4(0.0, 1.0 - at.y, at.y, 0.0);
        by[k] = cubic_lagrange(at.y) - ly[k];
        ex[k] = to_edges(there.x, cell.x, size.x, walled);
        ey[k] = to_edges(there.y, cell.y, size.y, walled);
    }
    for (int k = 0; k < 4; ++k) corners[k] = vec2(0.0);
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
            if (i % 3 == 0 && j % 3 == 0) continue;
            vec2 read = texture(displacement, vec2(x[i], y[j])).rg;
            for (int k = 0; k < 4; ++k) {
                int a = k % 2, b = k / 2;
                corners[k] += (cx[a][i] * ly[b][j] + lx[a][i] * by[b][j]) * vec2(ex[a][i], ey[b][j]) * read;
            }
        }
}

// As the four, of six.
void to_edges(float p, float cell, float count, float walled, out float weights[6]) {
    float first = walled * float(cell <= 2.0), last = walled * float(cell >= count - 4.0);
    for (int k = 0; k < 6; ++k) {
        float at = cell - 1.5 + float(k);
        weights[k] = mix(1.0, p / at, first) * mix(1.0, (count - p) / (count - at), last);
    }
}

// Six-point quintic both ways: on an accumulated map of twice the grid as good as the cubic on one of four times. 36 reads.
vec4 quintic_texels(sampler2D displacement, vec2 p, float walled) {
    vec2 size = vec2(textureSize(displacement, 0)), texel = 1.0 / size;
    vec2 cell = clamp(floor(p - 0.5), vec2(2.0), size - 4.0), f = p - 0.5 - cell;
    float wx[6], wy[6];
    quintic_lagrange(f.x, wx);
    quintic_lagrange(f.y, wy);
    float ex[6], ey[6];
    to_edges(p.x, cell.x, size.x, walled, ex);
    to_edges(p.y, cell.y, size.y, walled, ey);
    vec2 corner = (cell - 1.5) * texel;
    vec4 sum = vec4(0.0);
    for (int j = 0; j < 6; ++j)
        for (int i = 0; i < 6; ++i)
            sum += wx[i] * wy[j] * texture(displacement, corner + vec2(i, j) * texel) * vec4(ex[i], ey[j], 1.0, 1.0);
    return sum;
}

vec2 quintic_displacement(sampler2D displacement, vec2 p, float walled) { return quintic_texels(displacement, p, walled).rg; }
