// Handle carry: see handle_carry.frag.
#include "lib/listed.vert"
