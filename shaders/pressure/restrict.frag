// Right-hand side of the coarser level: the sum of the residual over what each coarse cell stands for.
// (The coarse cells' sides are twice as long, which the factor 4 of the sum over the mean accounts for.)
// in:  u_residual   at blocks of the finer level;  u_links   see links.frag, not needed with OPEN (no solids)
// out: right-hand side at blocks of the coarser level, the same unit
// reads: 8
uniform sampler2D u_residual;
uniform sampler2D u_links;

out vec4 out_residual;

float total(vec2 block, vec2 size) {
    vec2 uv = block / size;
    // The coarser level is padded to an even number of cells.
    vec4 members = vec4(all(lessThan(block, size)));
#ifndef OPEN
    int inside = int(texture(u_links, uv).r * 255.0 + 0.5);
    members *= vec4(inside & 1, (inside >> 1) & 1, (inside >> 2) & 1, (inside >> 3) & 1);
#endif
    return dot(texture(u_residual, uv), members);
}

void main() {
    vec2 size = vec2(textureSize(u_residual, 0)), a = 2.0 * floor(gl_FragCoord.xy) + 0.5, b = a + 1.0;
    out_residual = vec4(total(a, size), total(vec2(b.x, a.y), size), total(vec2(a.x, b.y), size), total(b, size));
}
