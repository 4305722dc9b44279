"""Memory that has been freed, and that the system is to have: glibc, left to itself, keeps most of it.

Above all textures of a software rasteriser, which come and go in any order, and leave gaps that others do not fit into.
"""

from __future__ import annotations

import ctypes
import os
from functools import cache

# Bytes from which on a block is the system's again once it is freed: half of a tile of the map.
LARGE = 2**18
SPARE = 2**24  # bytes at the end of the heap that are kept for what comes next

TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # as malloc.h of glibc numbers them


def map_large_blocks() -> None:
    """Let each large block be a mapping of its own from now on, which goes as a whole.

    glibc begins with 128 KiB, but counts 32 MiB as small once a block as large has been freed. Of checkpoints of a very
    large picture a third was kept then beyond what they hold.
    """
    if (library := _glibc()) is not None:
        library.mallopt(MMAP_THRESHOLD, LARGE)
        library.mallopt(TRIM_THRESHOLD, SPARE)


def hand_back() -> None:
    """Let the system have what has been freed of small blocks.

    glibc keeps what lies below anything that is still in use.
    """
    if (library := _glibc()) is not None:
        library.malloc_trim(0)


@cache
def _glibc() -> ctypes.CDLL | None:
    """The C library of this process, if it is glibc: no other has `malloc_trim`."""
    library = ctypes.CDLL(None) if os.name == "posix" else None
    return library if hasattr(library, "malloc_trim") else None
