// Slip: the part of its own speed that a push gives to the fluid, into a texel for each image: 1 for what lies as it lay in the
// picture, less the more radii it has come with the brush already and the more the push would stretch what is stretched
// several times over. Drawn out without end, it would become finer than the map, which would fold there.
//   dC/dt = -(grad v)^T C - C grad v,  C = J^T J,  J = I + grad D:  growth = -2 (C : grad v) / tr C for the brush's own
//   flow v = curl (b (F x r)), F a unit, so in e-folds of C a radius of the path; strain = sqrt(tr C / 2) growth where
//   that is positive, in the mean over the brush of its fourth power.
// What is pushed back to where it came from becomes shorter again, and is held as firmly as at first.
// u_around: the warp map's displacement on a lattice around each, one below the other, longer sides, their texels 1 / fine of
// the radius apart, the middle ones at u_places (longer sides); u_extent: width and height of the domain, longer sides.
// u_velocities: the brush's, lengths / s; u_carried: radii that something is carried before the push slips, and the least that it
// gives for that reason; u_strain: where it begins to slip, and gives nothing; u_hold: 0-1, how little of both.
// reads: 1157
#include "lib/brush.glsl"
#include "lib/images.glsl"
uniform sampler2D u_around;
uniform vec2 u_velocities[MOST_IMAGES];
uniform vec2 u_carried;
uniform float u_hold;
uniform vec2 u_strain;
uniform vec2 u_places[MOST_IMAGES];
uniform vec2 u_extent;
layout(location = 0) out float out_slip;

// Texels of the lattice along the radius: it reaches one beyond the brush on either side.
int fine() { return textureSize(u_around, 0).x / 2 - 1; }

int image() { return int(gl_FragCoord.x); }

vec2 displacement(ivec2 node) {
    ivec2 middle = fine() + 1 + ivec2(0, image() * textureSize(u_around, 0).x);
    return texelFetch(u_around, middle + node, 0).rg / u_radius;
}

float by_path(vec2 back, vec2 direction) {
    float far = length(back);
    if (far == 0.0) return 1.0;
    float along = 1.0 - smoothstep(0.0, 1.0, dot(back, direction) / far);
    float beyond = max(far * along - u_carried.x, 0.0);
    return mix(u_carried.y, 1.0, 1.0 / (1.0 + 2.0 * beyond * beyond));
}

float strain(ivec2 node, vec2 direction) {
    vec2 e = vec2(1.0 / float(fine()), 0.0);
    float scale = 0.5 * float(fine());
    vec2 r = vec2(node) * e.x;
    vec2 jx = vec2(1.0, 0.0) + scale * (displacement(node + ivec2(1, 0)) - displacement(node - ivec2(1, 0)));
    vec2 jy = vec2(0.0, 1.0) + scale * (displacement(node + ivec2(0, 1)) - displacement(node - ivec2(0, 1)));
    vec2 vx = scale * (brush_flow(r + e.xy, direction) - brush_flow(r - e.xy, direction));
    vec2 vy = scale * (brush_flow(r + e.yx, direction) - brush_flow(r - e.yx, direction));
    float xx = dot(jx, jx), xy = dot(jx, jy), yy = dot(jy, jy);
    float growth = -2.0 * (xx * vx.x + xy * (vx.y + vy.x) + yy * vy.y) / max(xx + yy, 1e-6);
    return sqrt(0.5 * (xx + yy)) * max(growth, 0.0);
}

float by_strain(vec2 direction) {
    int fine = fine();
    float sum = 0.0, count = 0.0;
    for (int j = -fine; j <= fine; ++j)
        for (int i = -fine; i <= fine; ++i) {
            vec2 r = vec2(i, j) / float(fine), place = u_places[image()] + r * u_radius;
            bool inside = all(greaterThan(place, vec2(0.0))) && all(lessThan(place, u_extent));
            if (dot(r, r) >= 1.0 || !inside) continue;
            float here = strain(ivec2(i, j), direction);
            sum += here * here * here * here;
            count += 1.0;
        }
    return 1.0 - smoothstep(u_strain.x, u_strain.y, sqrt(sqrt(sum / max(count, 1.0))));
}

void main() {
    vec2 velocity = u_velocities[image()];
    float speed = length(velocity);
    vec2 direction = velocity / max(speed, 1e-9);
    out_slip = speed == 0.0 ? 1.0 : mix(by_path(displacement(ivec2(0)), direction) * by_strain(direction), 1.0, u_hold);
}
