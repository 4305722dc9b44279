// Twirl: make the fluid under the brush turn at a rate, drawn with additive blending: dv = gain domega b(r) (-y, x),
// and where images of the brush overlap, of each its share.
// u_motion: the fluid's motion at each image, from probe; v_vector.x: wanted rotation, rad / s, positive clockwise.
// vertices: lib/images.vert
// reads: 1, and 10 when ATTENUATED
#include "lib/brush.glsl"
#include "lib/attenuation.glsl"
uniform sampler2D u_motion;
uniform float u_gain;
uniform vec2 u_spacing;
flat in vec4 v_segment;
flat in vec2 v_vector;
flat in int v_number;
flat in float v_share;
layout(location = 0) out vec2 out_velocity;

vec2 spin(vec2 cell, float rate, float viscosity) {
    vec2 r = cell * u_spacing - v_segment.zw;
    return rate * brush_falloff(length(r)) * vec2(-r.y, r.x) * attenuation(cell, viscosity);
}

void main() {
    vec2 cell = floor(gl_FragCoord.xy);
    ivec2 image = ivec2(v_number, 0);
    vec4 motion = texelFetch(u_motion, image, 0);
    float lacks = v_vector.x - motion.z;
    float rate = u_gain * unobstructed(image) * v_share * (v_vector.x > 0.0 ? max(lacks, 0.0) : min(lacks, 0.0));
    vec2 velocity = vec2(spin(cell + vec2(0.0, 0.5), rate, motion.w).x, spin(cell + vec2(0.5, 0.0), rate, motion.w).y);
    out_velocity = velocity * vec2(greaterThan(cell, vec2(0.5)));
}
