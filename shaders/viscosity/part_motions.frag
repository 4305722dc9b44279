// Motions: how each stiff part answers force and torque, moving as one piece.
// u_loads: the entries of gather_parts.frag, row after row; u_parts: (first entry, entries, centre x, centre y) by part;
// u_response: the inverse of each part's 3 x 3 matrix, a row of it to a texel.
// out: (a, b, w), the velocity (a - w y, b + w x) with x, y in cells.
// reads: 1028
uniform sampler2D u_loads;
uniform sampler2D u_parts;
uniform sampler2D u_response;
layout(location = 0) out vec4 out_motion;

void main() {
    int part = int(gl_FragCoord.x), width = textureSize(u_loads, 0).x;
    vec4 about = texelFetch(u_parts, ivec2(part, 0), 0);
    vec3 load = vec3(0.0);
    for (int e = int(about.x); e < int(about.x + about.y); ++e) load += texelFetch(u_loads, ivec2(e % width, e / width), 0).xyz;
    vec3 motion = vec3(dot(texelFetch(u_response, ivec2(part, 0), 0).xyz, load),
                       dot(texelFetch(u_response, ivec2(part, 1), 0).xyz, load),
                       dot(texelFetch(u_response, ivec2(part, 2), 0).xyz, load));
    out_motion = vec4(motion.x + motion.z * about.w, motion.y - motion.z * about.z, motion.z, 0.0);
}
