"""The GLSL sources, read as package data by `solver.gl.program`."""
