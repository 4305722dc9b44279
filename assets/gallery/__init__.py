"""The paper's figures made again: their recipes, and the pictures these need."""
