// Reading a displacement between its texels, at position p (in texels, (0,0) the top left corner), by Lagrange polynomials.
// `images` says of the left, right, top and bottom edge what lies beyond it: 1 or -1, where nothing crosses it, images of the
// texels inside, as of the velocity (lib/walls.glsl): the component across the edge is odd, that along it even (1, it glides)
// or odd too (-1, it sticks). 0: nothing; the outermost texels are taken, and the map goes on as the same polynomial.
// texture() with nearest filtering: exact at texel centres, and cheaper than texelFetch in software.
#include "lib/cubic.glsl"
#include "lib/quintic.glsl"

// The second of the four texels around p, or with `reach` 2 the third of six, counted from 0.
vec2 cell_at(vec2 p, vec2 size, float reach, vec4 images) {
    vec4 beyond = (reach + 1.0) * abs(images);
    return clamp(floor(p - 0.5), reach - beyond.xz, size - 2.0 - reach + beyond.yw);
}

// Along one axis, where the texels lie whose images those `at` these places are, and how often they count: of the component
// across the edges, and of that along them.
vec4 imaged(vec4 at, float count, vec2 images, out vec4 across, out vec4 along) {
    vec4 place = count - abs(count - abs(at));
    bvec4 inside = equal(place, at);
    across = mix(vec4(-1.0), vec4(1.0), inside);
    along = mix(vec4(at.x < 0.0 ? images.x : images.y), vec4(1.0), inside);
    return place;
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
// fourth component, is even at all edges. 12 reads.
vec4 cubic_texels(sampler2D displacement, vec2 p, vec4 images) {
    vec2 size = vec2(textureSize(displacement, 0)), texel = 1.0 / size;
    vec2 cell = cell_at(p, size, 1.0, images), f = p - 0.5 - cell;
    vec4 cx = cubic_lagrange(f.x), cy = cubic_lagrange(f.y), ux, uy, vx, vy;
    vec2 lx = vec2(1.0 - f.x, f.x), ly = vec2(1.0 - f.y, f.y), bend = cx.yz - lx;
    vec4 x = imaged(cell.x + vec4(-0.5, 0.5, 1.5, 2.5), size.x, images.xy, ux, vx) * texel.x;
    vec4 y = imaged(cell.y + vec4(-0.5, 0.5, 1.5, 2.5), size.y, images.zw, vy, uy) * texel.y;
#define AT(i, j) texture(displacement, vec2(x[i], y[j])) * vec4(ux[i], vx[i], 1.0, 1.0)
#define ROW(j) vec4(uy[j], vy[j], 1.0, 1.0)
    return ROW(1) * ((cy.y * lx.x + ly.x * bend.x) * AT(1, 1) + (cy.y * lx.y + ly.x * bend.y) * AT(2, 1))
         + ROW(2) * ((cy.z * lx.x + ly.y * bend.x) * AT(1, 2)) + ROW(2) * ((cy.z * lx.y + ly.y * bend.y) * AT(2, 2))
         + ROW(1) * (ly.x * (cx.x * AT(0, 1) + cx.w * AT(3, 1))) + ROW(2) * (ly.y * (cx.x * AT(0, 2) + cx.w * AT(3, 2)))
         + ROW(0) * (cy.x * (lx.x * AT(1, 0) + lx.y * AT(2, 0))) + ROW(3) * (cy.w * (lx.x * AT(1, 3) + lx.y * AT(2, 3)));
#undef ROW
#undef AT
}

vec2 cubic_displacement(sampler2D displacement, vec2 p, vec4 images) { return cubic_texels(displacement, p, images).rg; }

// The same with its own derivatives along x (first column) and y, to a texel: far from the middle of the four points, as in
// a corner without images, those of another cubic would not tell of its folds. 16 reads.
vec4 cubic_texels(sampler2D displacement, vec2 p, vec4 images, out mat2x4 slope) {
    vec2 size = vec2(textureSize(displacement, 0)), texel = 1.0 / size;
    vec2 cell = cell_at(p, size, 1.0, images), f = p - 0.5 - cell;
    vec4 lx = vec4(0.0, 1.0 - f.x, f.x, 0.0), ly = vec4(0.0, 1.0 - f.y, f.y, 0.0), along = vec4(0.0, -1.0, 1.0, 0.0);
    vec4 cx = cubic_lagrange(f.x), sx = cubic_slope(f.x), by = cubic_lagrange(f.y) - ly, sy = cubic_slope(f.y) - along;
    vec4 ux, uy, vx, vy;
    vec4 x = imaged(cell.x + vec4(-0.5, 0.5, 1.5, 2.5), size.x, images.xy, ux, vx) * texel.x;
    vec4 y = imaged(cell.y + vec4(-0.5, 0.5, 1.5, 2.5), size.y, images.zw, vy, uy) * texel.y;
    vec4 sum = vec4(0.0);
    slope = mat2x4(0.0);
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
            vec4 value = texture(displacement, vec2(x[i], y[j])) * vec4(ux[i] * uy[j], vx[i] * vy[j], 1.0, 1.0);
            sum += (cx[i] * ly[j] + lx[i] * by[j]) * value;
            slope[0] += (sx[i] * ly[j] + along[i] * by[j]) * value;
            slope[1] += (cx[i] * along[j] + lx[i] * sy[j]) * value;
        }
    return sum;
}

vec2 cubic_displacement(sampler2D displacement, vec2 p, vec4 images, out mat2 slope) {
    mat2x4 slopes;
    vec2 sum = cubic_texels(displacement, p, images, slopes).rg;
    slope = mat2(slopes[0].rg, slopes[1].rg);
    return sum;
}

// What a level is read from: of the four cells around a place the displacement (rg of `value`), how its second differences
// along x differ along y (ba), and those along x (rg of `bend`) and y (ba); see warp/difference.frag.
struct Nodes {
    vec4 value[4];
    vec4 bend[4];
};

// The cells of what it is read from: of two halves one below the other, each with a border of a cell.
vec2 cells_of(sampler2D differences) { return vec2(textureSize(differences, 0)) * vec2(1.0, 0.5) - 2.0; }

// 8 reads; f: where p lies between them, 0-1. What lies beyond the edges is in the border.
Nodes nodes_at(sampler2D differences, vec2 p, vec4 images, out vec2 f) {
    vec2 cell = cell_at(p, cells_of(differences), 0.0, images), texel = 1.0 / vec2(textureSize(differences, 0));
    f = p - 0.5 - cell;
    Nodes nodes;
    for (int k = 0; k < 4; ++k) {
        vec2 place = (cell + 1.5 + vec2(k % 2, k / 2)) * texel;
        nodes.value[k] = texture(differences, place);
        nodes.bend[k] = texture(differences, place + vec2(0.0, 0.5));
    }
    return nodes;
}

// Everett's formula up to second differences, and its derivative: how much they count, a part t of a cell from the next one.
vec2 everett(vec2 t) { return t * (t * t - 1.0) * (1.0 / 6.0); }
vec2 everett_slope(vec2 t) { return 0.5 * t * t - 1.0 / 6.0; }

// Between four cells, linearly and bent by second differences along either axis and along both.
vec2 between_nodes(Nodes nodes, vec2 f) {
    vec2 lx = vec2(1.0 - f.x, f.x), ly = vec2(1.0 - f.y, f.y), ex = everett(lx), ey = everett(ly), sum = vec2(0.0);
    for (int j = 0; j < 2; ++j)
        sum += ly[j] * (lx.x * nodes.value[2 * j].rg + lx.y * nodes.value[2 * j + 1].rg
                        + ex.x * nodes.bend[2 * j].rg + ex.y * nodes.bend[2 * j + 1].rg)
             + ey[j] * (lx.x * nodes.bend[2 * j].ba + lx.y * nodes.bend[2 * j + 1].ba
                        + ex.x * nodes.value[2 * j].ba + ex.y * nodes.value[2 * j + 1].ba);
    return sum;
}

// The same with its derivatives along x (first column) and y, to a cell.
vec2 between_nodes(Nodes nodes, vec2 f, out mat2 slope) {
    vec2 lx = vec2(1.0 - f.x, f.x), ly = vec2(1.0 - f.y, f.y), ex = everett(lx), ey = everett(ly), sum = vec2(0.0);
    vec2 along = vec2(-1.0, 1.0), sx = along * everett_slope(lx), sy = along * everett_slope(ly);
    slope = mat2(0.0);
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
            vec4 value = nodes.value[2 * j + i], bend = nodes.bend[2 * j + i];
            vec2 across = lx[i] * value.rg + ex[i] * bend.rg, bent = lx[i] * bend.ba + ex[i] * value.ba;
            sum += ly[j] * across + ey[j] * bent;
            slope[0] += ly[j] * (along[i] * value.rg + sx[i] * bend.rg) + ey[j] * (along[i] * bend.ba + sx[i] * value.ba);
            slope[1] += along[j] * across + sy[j] * bent;
        }
    return sum;
}

vec2 bent_displacement(sampler2D differences, vec2 p, vec4 images) {
    vec2 f;
    Nodes nodes = nodes_at(differences, p, images, f);
    return between_nodes(nodes, f);
}

// Six-point quintic both ways: on an accumulated map of twice the grid as good as the cubic on one of four times. 36 reads.
vec4 quintic_texels(sampler2D displacement, vec2 p, vec4 images) {
    vec2 size = vec2(textureSize(displacement, 0)), texel = 1.0 / size;
    vec2 cell = cell_at(p, size, 2.0, images), f = p - 0.5 - cell;
    float wx[6], wy[6];
    quintic_lagrange(f.x, wx);
    quintic_lagrange(f.y, wy);
    vec4 ux[2], uy[2], vx[2], vy[2], x[2], y[2];
    for (int k = 0; k < 2; ++k) {
        vec4 first = float(3 * k) + vec4(-1.5, -0.5, 0.5, 1.5);
        x[k] = imaged(cell.x + first, size.x, images.xy, ux[k], vx[k]) * texel.x;
        y[k] = imaged(cell.y + first, size.y, images.zw, vy[k], uy[k]) * texel.y;
    }
    vec4 sum = vec4(0.0);
    for (int j = 0; j < 6; ++j)
        for (int i = 0; i < 6; ++i) {
            int a = i / 3, b = j / 3, m = i % 3, n = j % 3;
            vec4 across = wx[i] * vec4(ux[a][m], vx[a][m], 1.0, 1.0), down = wy[j] * vec4(uy[b][n], vy[b][n], 1.0, 1.0);
            sum += across * down * texture(displacement, vec2(x[a][m], y[b][n]));
        }
    return sum;
}

vec2 quintic_displacement(sampler2D displacement, vec2 p, vec4 images) { return quintic_texels(displacement, p, images).rg; }
