"""Fences of GL, held so that a software rasteriser does not free its own too early."""

from __future__ import annotations

import ctypes
from collections import deque

import moderngl

_GPU_COMMANDS_COMPLETE = 0x9117  # GL_SYNC_GPU_COMMANDS_COMPLETE
_HELD = 256  # llvmpipe has at most 64 scenes under way


class Fences:
    """A fence behind each of the last draws.

    Mesa's llvmpipe (22.3, and the source of 2025) corrupts the heap without them. Of a scene that is drawn its fence
    counts the threads that are through with it: the last of them counts up under the fence's lock, and then unlocks it.
    But who issues the next scenes reads the count without that lock, and the fence is freed when the next scene is
    queued; where the last thread had to wait for a processor in between, it unlocks what is freed, or by then is
    something else. A fence of GL shares the driver's. The threads meet before each scene, and scenes are drawn in
    order: one that has another finished scene behind it, as all but the last 65 have, is no longer in any thread's
    hands.

    Args:
        ctx: the context, current whenever something is drawn.
        needed: False if the driver is another, or has no threads of its own; then nothing is held.
    """

    def __init__(self, ctx: moderngl.Context, needed: bool) -> None:
        self._needed = needed
        self._held: deque[int | None] = deque()
        if needed:
            load = ctx.mglo._context.load_opengl_function
            self._create = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.c_uint, ctypes.c_uint)(load("glFenceSync"))
            self._delete = ctypes.PYFUNCTYPE(None, ctypes.c_void_p)(load("glDeleteSync"))

    def hold(self) -> None:
        """Hold the fence of what was drawn just now; to be called after every draw, clear and copy."""
        if not self._needed:
            return
        self._held.append(self._create(_GPU_COMMANDS_COMPLETE, 0))
        if len(self._held) > _HELD:
            self._delete(self._held.popleft())
