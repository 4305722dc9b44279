// Advect: w2(x) = decay w1(x_d), each component of what departs carried to its own faces from where these depart, by the
// four-point cubic along each axis; packed 2 x 2 cells a texel as viscosity/operator.glsl has it, 0 on fixed faces.
// u_blocks_u, u_blocks_v: w1 as depart.frag lays it; u_trace: backtrace of the cell centres, cells; u_decay: exp(-drag dt).
// A face departs midway between the two cells that it parts, so inside the grid, where those do.
// Beside w2: |w1|^2 of the faces in the texel, as if they stayed where they are; with PARTIAL each times its open part,
// u_left and u_up of lib/block.glsl.
// reads: 58, and 60 with PARTIAL
#include "lib/cubic.glsl"
#ifdef UNIFORM
#include "viscosity/box.glsl"
#else
#include "viscosity/openness.glsl"
#endif
uniform sampler2D u_blocks_u;
uniform sampler2D u_blocks_v;
uniform sampler2D u_trace;
uniform float u_decay;
#ifdef PARTIAL
uniform sampler2D u_left;
uniform sampler2D u_up;
#endif
layout(location = 0) out vec4 out_u;
layout(location = 1) out vec4 out_v;
layout(location = 2) out float out_departed;

// Two columns of 2 x 2 faces from the cubic's first one on; the rows from an even one on, which may be the one before.
float cubic(sampler2D blocks, vec2 place, vec2 texel) {
    vec2 corner = floor(place), f = place - corner, first = corner - 1.0;
    float half_y = floor(0.5 * first.y), odd = first.y - 2.0 * half_y;
    vec4 x = cubic_lagrange(f.x).xyxy, x_far = cubic_lagrange(f.x).zwzw, wy = cubic_lagrange(f.y);
    vec4 y = mix(wy, vec4(0.0, wy.xyz), odd);
    vec2 at = (vec2(first.x, half_y) + vec2(2.5, 1.5)) * texel;
#define ROWS(j) (x * texture(blocks, vec2(at.x, at.y + float(j) * texel.y)) + x_far * texture(blocks, vec2(at.x + 2.0 * texel.x, at.y + float(j) * texel.y)))
    return dot(y.xxyy, ROWS(0)) + dot(y.zzww, ROWS(1)) + odd * wy.w * dot(vec2(1.0), ROWS(2).xy);
}

void main() {
    vec2 cell = 2.0 * own_texel(), texel = 1.0 / vec2(textureSize(u_blocks_u, 0)), x = vec2(1.0, 0.0), y = vec2(0.0, 1.0);
    vec2 pace = 1.0 / vec2(textureSize(u_trace, 0)), here = (cell + 0.5) * pace;
    vec4 columns = vec4(here.x - pace.x, here.x, here.x + pace.x, 0.0), lines = vec4(here.y - pace.y, here.y, here.y + pace.y, 0.0);
#define BACK(i, j) texture(u_trace, vec2(columns[i], lines[j])).rg
    vec2 a = BACK(1, 1), b = BACK(2, 1), c = BACK(1, 2), d = BACK(2, 2);
    vec4 free_u = open_u(own_texel()), free_v = open_v(own_texel());
    out_u = u_decay * free_u * vec4(cubic(u_blocks_u, cell + 0.5 * (a + BACK(0, 1)), texel), cubic(u_blocks_u, cell + x + 0.5 * (b + a), texel),
                           cubic(u_blocks_u, cell + y + 0.5 * (c + BACK(0, 2)), texel), cubic(u_blocks_u, cell + 1.0 + 0.5 * (d + c), texel));
    out_v = u_decay * free_v * vec4(cubic(u_blocks_v, cell + 0.5 * (a + BACK(1, 0)), texel), cubic(u_blocks_v, cell + x + 0.5 * (b + BACK(2, 0)), texel),
                           cubic(u_blocks_v, cell + y + 0.5 * (c + a), texel), cubic(u_blocks_v, cell + 1.0 + 0.5 * (d + b), texel));
#undef BACK
    vec2 own = (cell * vec2(1.0, 0.5) + vec2(2.5, 1.5)) * texel;
    vec4 u = free_u * texture(u_blocks_u, own), v = free_v * texture(u_blocks_v, own);
#ifdef PARTIAL
    vec2 block = (own_texel() + 0.5) / vec2(textureSize(u_left, 0));
    out_departed = dot(texture(u_left, block), u * u) + dot(texture(u_up, block), v * v);
#else
    out_departed = dot(u, u) + dot(v, v);
#endif
}
