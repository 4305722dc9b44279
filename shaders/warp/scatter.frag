// Scatter: F(y) = x - y for the point x of the result that is looked up at y, a first guess of the forward map.
// v_place (x): 0-1, from scatter.vert; u_extent: width and height of the domain, longer sides.
// vertices: warp/scatter.vert
// reads: 0
uniform sampler2D u_displacement;
uniform vec2 u_extent;
in vec2 v_place;
layout(location = 0) out vec2 out_displacement;

void main() {
    out_displacement = (v_place - gl_FragCoord.xy / vec2(textureSize(u_displacement, 0))) * u_extent;
}
