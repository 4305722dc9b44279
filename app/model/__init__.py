"""The recipe and all its parts, as values: no file, no GL and no window."""
