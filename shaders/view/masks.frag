// Masks: what is laid over the canvas where the fluid is thicker or thinner, or frozen, premultiplied; x: see canvas.frag.
// VISCOSITY: tint of decades over u_base, u_viscosity of the recipe's, over u_window (left, top, width and height, 0-1 of the
// picture), and u_thickness painted; and contour lines of whole ones, u_contour pixels wide.
// FROZEN: hatch where u_frozen is 1/2 or more, its stripes u_hatch pixels apart, the first u_first before the corner.
// The colours are told apart by those who do not see red and green apart (Okabe and Ito).
// reads: 0, and 2 with VISCOSITY, 1 with FROZEN
#include "lib/decades.glsl"
uniform vec2 u_origin;
uniform vec2 u_step;
uniform float u_target_height;
#ifdef VISCOSITY
uniform sampler2D u_viscosity;
uniform sampler2D u_thickness;
uniform vec4 u_window;
uniform float u_base;
uniform float u_viscosity_opacity;
uniform float u_contour;
#endif
#ifdef FROZEN
uniform sampler2D u_frozen;
uniform float u_frozen_opacity;
uniform float u_hatch;
uniform float u_first;
#endif
layout(location = 0) out vec4 out_colour;

vec4 with(vec4 under, vec3 colour, float part) { return mix(under, vec4(colour, 1.0), part); }

void main() {
    vec2 x = (vec2(gl_FragCoord.x, u_target_height - gl_FragCoord.y) - u_origin) * u_step;
    vec4 seen = vec4(0.0);
#ifdef VISCOSITY
    vec2 cell = (x - u_window.xy) / u_window.zw;
    float within = float(all(greaterThanEqual(cell, vec2(0.0))) && all(lessThanEqual(cell, vec2(1.0))));
    float thicker = within * log(max(texture(u_viscosity, cell).r, 1e-6) / u_base) * 0.4342945
                  + decades(texture(u_thickness, x).r);
    vec3 tint = thicker > 0.0 ? vec3(0.80, 0.30, 0.62) : vec3(0.34, 0.71, 0.91);
    seen = with(seen, tint, u_viscosity_opacity * clamp(abs(thicker) * 0.28, 0.0, 0.75));
    // Where it is the same all around there is no line, whatever it is.
    float steep = fwidth(thicker), off = abs(fract(thicker - 0.5) - 0.5);
    if (steep > 2e-4 && abs(thicker) > 0.5) {
        float far = off / (steep * u_contour);
        seen = with(seen, vec3(0.0), u_viscosity_opacity * 0.4 * (1.0 - smoothstep(0.8, 1.8, far)));
        seen = with(seen, vec3(1.0), u_viscosity_opacity * (1.0 - smoothstep(0.3, 0.9, far)));
    }
#endif
#ifdef FROZEN
    // One pixel wide at the edge, whether the mask's texels are smaller or larger than that.
    float inside = texture(u_frozen, x).r - 0.5, frozen = clamp(inside / max(fwidth(inside), 1e-3) + 0.5, 0.0, 1.0);
    float stripe = abs(fract((gl_FragCoord.x + gl_FragCoord.y + u_first) / u_hatch) - 0.5) * 2.0;
    vec3 ice = mix(vec3(0.0, 0.45, 0.70), vec3(0.80, 0.93, 1.0), smoothstep(0.60, 0.75, stripe));
    seen = with(seen, ice, u_frozen_opacity * frozen * 0.72);
#endif
    out_colour = seen;
}
