// The pressure's graphs: levels of which the unknowns are connected pieces of blocks, in a list of WIDTH to a row.
//   u_rows    of each unknown: its first link, their number, the sum of their weights, and its unknown of the next level
//   u_links   in a list, of each link: the unknown at its other end, its weight
const int WIDTH = 256;

vec4 at(sampler2D list, float index) {
    int i = int(index);
    return texelFetch(list, ivec2(i % WIDTH, i / WIDTH), 0);
}

// A p of an unknown, `row` its texel of u_rows and `here` its p.
float laplacian(sampler2D p, sampler2D links, vec4 row, float here) {
    float sum = 0.0;
    for (float k = 0.0; k < row.y; k++) {
        vec2 link = at(links, row.x + k).xy;
        sum += link.y * (at(p, link.x).r - here);
    }
    return sum;
}
