// The dot products r . z and r . r, summed over the block.
// in:  u_residual, u_z   r and z at blocks
// reads: 2
uniform sampler2D u_residual;
uniform sampler2D u_z;

in vec2 v_uv;
out vec4 out_products;

void main() {
    vec4 r = texture(u_residual, v_uv);
    out_products = vec4(dot(r, texture(u_z, v_uv)), dot(r, r), 0.0, 0.0);
}
