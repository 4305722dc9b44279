"""The physics of fluidwarp on the GPU; see the README for the scripting interface."""
