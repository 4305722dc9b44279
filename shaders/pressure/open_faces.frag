// The faces of the finest level: a face is open (1) between two cells of the grid that are both fluid, else closed (0).
// in:  u_solid   1 = solid cell, at cells
// out: left, up, far of lib/block.glsl
// reads: 12
uniform sampler2D u_solid;

layout(location = 0) out vec4 out_left;
layout(location = 1) out vec4 out_up;
layout(location = 2) out vec4 out_far;

float fluid(ivec2 cell) {
    ivec2 size = textureSize(u_solid, 0);
    if (any(lessThan(cell, ivec2(0))) || any(greaterThanEqual(cell, size))) return 0.0;
    return float(texelFetch(u_solid, cell, 0).r < 0.5);
}

void main() {
    ivec2 c = 2 * ivec2(gl_FragCoord.xy);
    vec4 here = vec4(fluid(c), fluid(c + ivec2(1, 0)), fluid(c + ivec2(0, 1)), fluid(c + ivec2(1, 1)));
    vec2 left = vec2(fluid(c + ivec2(-1, 0)), fluid(c + ivec2(-1, 1)));
    vec2 right = vec2(fluid(c + ivec2(2, 0)), fluid(c + ivec2(2, 1)));
    vec2 up = vec2(fluid(c + ivec2(0, -1)), fluid(c + ivec2(1, -1)));
    vec2 down = vec2(fluid(c + ivec2(0, 2)), fluid(c + ivec2(1, 2)));
    out_left = here * vec4(left.x, here.x, left.y, here.z);
    out_up = here * vec4(up, here.xy);
    out_far = vec4(here.yw * right, here.zw * down);
}
