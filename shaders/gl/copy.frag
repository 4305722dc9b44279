// Copy: the texels of another field, its texel u_offset first.
// u_field: any texels; u_offset: whole texels.
// reads: 1
uniform sampler2D u_field;
uniform vec2 u_offset;
layout(location = 0) out vec4 out_texel;

void main() { out_texel = texelFetch(u_field, ivec2(floor(gl_FragCoord.xy) + u_offset), 0); }
