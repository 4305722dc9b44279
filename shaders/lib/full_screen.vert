// One triangle that covers the target, made from the vertex number alone; v_uv runs 0-1 with row 0 at v = 0.
out vec2 v_uv;

void main() {
    v_uv = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(v_uv * 2.0 - 1.0, 0.0, 1.0);
}
