"""The parts of the window around the picture and on it, each a function of what it shows."""
