// The iterate x of the conjugate gradients and the search direction p = z + beta p_before; with FIRST the iterate is the
// guess a f + c d of guess_residual.frag, and p = z.
// u_u, u_v: f = v*; u_change_u, u_change_v: d; u_parts: (a, c); u_x_u, u_x_v: x; u_p_u, u_p_v: p_before; u_z_u, u_z_v: z;
// u_beta.
uniform sampler2D u_u;
uniform sampler2D u_v;
uniform sampler2D u_z_u;
uniform sampler2D u_z_v;
#ifdef FIRST
uniform sampler2D u_change_u;
uniform sampler2D u_change_v;
uniform vec2 u_parts;
vec4 iterate_u(vec2 at) { return u_parts.x * texture(u_u, at) + u_parts.y * texture(u_change_u, at); }
vec4 iterate_v(vec2 at) { return u_parts.x * texture(u_v, at) + u_parts.y * texture(u_change_v, at); }
vec4 direction_u(vec2 at) { return texture(u_z_u, at); }
vec4 direction_v(vec2 at) { return texture(u_z_v, at); }
#else
uniform sampler2D u_x_u;
uniform sampler2D u_x_v;
uniform sampler2D u_p_u;
uniform sampler2D u_p_v;
uniform float u_beta;
vec4 iterate_u(vec2 at) { return texture(u_x_u, at); }
vec4 iterate_v(vec2 at) { return texture(u_x_v, at); }
vec4 direction_u(vec2 at) { return texture(u_z_u, at) + u_beta * texture(u_p_u, at); }
vec4 direction_v(vec2 at) { return texture(u_z_v, at) + u_beta * texture(u_p_v, at); }
#endif
