// Carry: the local part of a push, b F and nothing beside it, drawn with additive blending; less its image beyond a wall
// that it pushes at or from, so that it comes to rest there smoothly.
// u_motion: the fluid at each image, from probe; u_slip: from slip, in row u_row; v_vector: the local part of its
// velocity, lengths / s; u_viscosity: cells, lengths^2 / s: what is thicker than at the brush is carried less.
// With SOLIDS: u_distance, cells, lengths to what is closed: within the radius all is carried less, beside it by the square of
// that. What is local knows no pressure, so in proportion to it all would be pressed together, or drawn out, exponentially
// with the way; and along it, held by nothing, be sheared within a cell.
// vertices: lib/images.vert
// reads: 5, and 9 with SOLIDS
#include "lib/brush.glsl"
uniform sampler2D u_motion;
uniform sampler2D u_slip;
uniform float u_row;
uniform sampler2D u_viscosity;
uniform vec2 u_spacing;
flat in vec4 v_segment;
flat in vec2 v_vector;
flat in int v_number;
flat in float v_share;
#ifdef SOLIDS
uniform sampler2D u_distance;
#endif
layout(location = 0) out vec2 out_velocity;

void main() {
    vec2 p = gl_FragCoord.xy, texel = 1.0 / vec2(textureSize(u_viscosity, 0));
    vec2 u = (p - vec2(0.5, 0.0)) * u_spacing, v = (p - vec2(0.0, 0.5)) * u_spacing, far = 2.0 * u_spacing / texel;
    vec2 weight = vec2(brush_weight(v_segment, u) - brush_weight(v_segment, vec2(-u.x, u.y)) - brush_weight(v_segment, vec2(far.x - u.x, u.y)),
                       brush_weight(v_segment, v) - brush_weight(v_segment, vec2(v.x, -v.y)) - brush_weight(v_segment, vec2(v.x, far.y - v.y)));
    vec2 uv = p * texel, left = uv - vec2(texel.x, 0.0), above = uv - vec2(0.0, texel.y);
    vec2 before = vec2(texture(u_viscosity, left).r, texture(u_viscosity, above).r);
    vec2 thickest = max(max(before, texture(u_viscosity, uv).r), 1e-9);
    ivec2 image = ivec2(v_number, 0);
    vec2 attenuation = min(max(texelFetch(u_motion, image, 0).w, 1e-9) / thickest, 1.0);
#ifdef SOLIDS
    vec2 both = texture(u_distance, uv).r + vec2(texture(u_distance, left).r, texture(u_distance, above).r);
    weight *= smoothstep(0.0, u_radius, 0.5 * both);
#endif
    float slip = texelFetch(u_slip, image + ivec2(0, int(u_row)), 0).r;
    out_velocity = slip * v_share * attenuation * max(weight, 0.0) * v_vector
                 * vec2(greaterThan(p, vec2(1.0)));
}
