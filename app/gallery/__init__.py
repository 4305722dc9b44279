"""`fluidwarp gallery`: the paper's figures, the guide's pictures, and what strokes of the hand do, made again."""
