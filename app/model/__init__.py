"""The recipe and all its parts: numpy and pydantic only, no GL, no file formats and no window."""
