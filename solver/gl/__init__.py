"""OpenGL and nothing of physics: the device, float textures, full-screen passes, sums over a texture."""
