"""One module for each kind of picture file, used through the table in `app.media.formats`.

Each has `read(file, max_pixels)`, which gives the `Picture` and raises anything where the file is damaged, and, where
we write the kind, `write(path, picture, quality)`, whose picture is in a depth and with channels that the kind has.
"""

ZLIB_LEVEL = 4  # on photographs as small as zlib's 6 within 1 %, in half the time
