// The grid's sides, and where the fluid sticks to what closes a face, a side or a solid cell; NO_SLIP: somewhere it does.
uniform vec2 u_box;             // cells between the sides
#ifdef NO_SLIP
uniform vec4 u_no_slip;         // 1 for the left, right, top and bottom side if it sticks there, else 0
uniform float u_solids_no_slip; // the same of solid cells
#else
const vec4 u_no_slip = vec4(0.0);
const float u_solids_no_slip = 0.0;
#endif

// 1 where the fluid sticks to a wall that meets nodes in these columns and rows: the side that they lie on, or solid cells.
vec4 sticks(vec4 column, vec4 row) {
#ifdef NO_SLIP
    vec4 found = mix(vec4(u_solids_no_slip), vec4(u_no_slip.x), vec4(lessThanEqual(column, vec4(0.0))));
    found = mix(found, vec4(u_no_slip.y), vec4(greaterThanEqual(column, vec4(u_box.x))));
    found = mix(found, vec4(u_no_slip.z), vec4(lessThanEqual(row, vec4(0.0))));
    return mix(found, vec4(u_no_slip.w), vec4(greaterThanEqual(row, vec4(u_box.y))));
#else
    return vec4(0.0);
#endif
}

// 1 where closed faces in these columns (or rows) are glided along; `far` of them lie between the sides (near, far).
vec4 glides(vec4 place, float far, vec2 no_slip) {
#ifdef NO_SLIP
    vec4 solid_or_far = mix(vec4(u_solids_no_slip), vec4(no_slip.y), vec4(greaterThanEqual(place, vec4(far))));
    return 1.0 - mix(solid_or_far, vec4(no_slip.x), vec4(lessThan(place, vec4(0.0))));
#else
    return vec4(1.0);
#endif
}

// `no_slip` of the two sides across which a level is coarsened; 0 for a single column or row (`alone` is 2), which is carried
// over as it is, whatever its walls are. (With one viscosity K at the walls is that of the coarse cells.)
vec2 sides_across(vec2 no_slip, float alone) {
#ifdef UNIFORM
    return no_slip;
#else
    return no_slip * (2.0 - alone);
#endif
}
