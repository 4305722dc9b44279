// The images of a brush: the same tip acts along several paths at once, itself and what its symmetry makes of it.
const int MOST_IMAGES = 16;
uniform vec4 u_segments[MOST_IMAGES];  // of each path a.xy, b.xy, lengths from the grid's corner
