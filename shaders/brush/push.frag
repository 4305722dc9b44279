// Push: make the fluid under the brush move with it, drawn with additive blending.
//   dv = curl psi,  psi = b (dF x r),  dF = gain scaling strength (slip v_brush - v_fluid),               (B1)
// r from the nearest point of the path: the discrete curl of a stream function at the nodes, so exactly free of
// divergence; at the path dv = dF, and where images of the brush overlap, of each its share. v_fluid is as it is measured where
// the path ends. With u_hold it is in that proportion as it is where the path begins, and passes from the one to the other within
// a radius: else the picture would lag behind what holds it.
// u_motion: the fluid's motion at each image, from probe; u_slip: from slip, in row u_row; u_scaling: from restrain;
// v_vector: the brush's velocity, lengths / s.
// vertices: lib/images.vert
// reads: 4, and 21 when ATTENUATED
#include "lib/brush.glsl"
#include "lib/attenuation.glsl"
uniform sampler2D u_motion;
uniform sampler2D u_slip;
uniform float u_row;
uniform sampler2D u_scaling;
uniform float u_strength;
uniform float u_gain;
uniform float u_hold;
uniform vec2 u_spacing;
flat in vec4 v_segment;
flat in vec2 v_vector;
flat in int v_number;
flat in float v_share;
layout(location = 0) out vec2 out_velocity;

// force: dF where the path ends; more: how much more it is where it begins.
float stream(vec2 node, vec2 force, vec2 more, float viscosity) {
    vec2 x = node * u_spacing, nearest = brush_nearest(v_segment, x), r = x - nearest;
    float far = distance(v_segment.xy, v_segment.zw), within = max(min(far, u_radius), 1e-9);
    force += (1.0 - smoothstep(0.0, within, distance(v_segment.xy, nearest))) * more;
    return brush_falloff(length(r)) * (force.x * r.y - force.y * r.x) * attenuation(node, viscosity);
}

void main() {
    vec2 cell = floor(gl_FragCoord.xy);
    ivec2 image = ivec2(v_number, 0);
    vec4 motion = texelFetch(u_motion, image, 0);
    float slip = texelFetch(u_slip, image + ivec2(0, int(u_row)), 0).r;
    float part = u_gain * texelFetch(u_scaling, image, 0).r * u_strength * unobstructed(image) * v_share;
    vec2 force = part * (slip * v_vector - motion.xy);
    vec2 more = part * u_hold * (motion.xy - texelFetch(u_motion, image + ivec2(0, 1), 0).xy);
    float corner = stream(cell, force, more, motion.w);
    vec2 velocity = vec2(stream(cell + vec2(0.0, 1.0), force, more, motion.w) - corner,
                         corner - stream(cell + vec2(1.0, 0.0), force, more, motion.w));
    out_velocity = velocity / u_spacing.yx * vec2(greaterThan(cell, vec2(0.5)));
}
