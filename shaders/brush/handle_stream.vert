// Handle stream: see handle_stream.frag.
#include "lib/listed.vert"
