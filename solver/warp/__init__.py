"""What the velocity carries: the map of the picture, its inverse, and densities."""
