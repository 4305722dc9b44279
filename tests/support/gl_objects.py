"""Which objects of OpenGL there are: what was made and never released shows."""

from __future__ import annotations

import ctypes
import gc
from collections import Counter
from collections.abc import Callable
from ctypes.util import find_library
from typing import Any

import moderngl
import pytest

from solver.gl.device import Device

KINDS = "Texture", "Framebuffer", "Buffer", "Query", "VertexArray", "Program", "Shader"
UNUSED = 30_000  # names in a row that are nobody's: a driver may go on counting when some are free again


def living(device: Device, *kinds: str) -> Counter[str]:
    """How many objects of each kind live in the device's context, once what nobody holds any more is released.

    Asked of the driver itself (`glIsTexture` and its like), name by name.

    Args:
        device: whose context is counted; it is made current.
        kinds: of `KINDS`; all of them if none is given.
    """
    gc.collect()
    device.collect()
    return Counter({kind: _count(kind) for kind in kinds or KINDS})


class Made:
    """Textures and framebuffers that are made from now on, which this keeps: no garbage collection frees them.

    Args:
        monkeypatch: of the test, at whose end nothing is noted any more.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._made: list[moderngl.Texture | moderngl.Framebuffer] = []
        for name in ("texture", "framebuffer"):
            monkeypatch.setattr(moderngl.Context, name, self._noting(getattr(moderngl.Context, name)))

    def _noting(self, make: Callable[..., Any]) -> Callable[..., Any]:
        def making(*args: Any, **named: Any) -> Any:
            self._made.append(make(*args, **named))
            return self._made[-1]

        return making

    @property
    def left(self) -> list[str]:
        """What of them has not been released: kind and size."""
        return [
            f"{type(one).__name__} {one.size}" for one in self._made if not isinstance(one.mglo, moderngl.InvalidObject)
        ]


def _count(kind: str) -> int:
    """How many names of this kind are an object's."""
    library = ctypes.CDLL(find_library("EGL") or "libEGL.so.1")
    library.eglGetProcAddress.restype = ctypes.c_void_p

    def function(name: str, result: type[ctypes.c_uint] | type[ctypes.c_ubyte] | None, *arguments: Any) -> Any:
        return ctypes.CFUNCTYPE(result, *arguments)(library.eglGetProcAddress(name.encode()))

    one = ctypes.c_uint()
    if kind in ("Program", "Shader"):
        words = () if kind == "Program" else (0x8B30,)  # GL_FRAGMENT_SHADER
        one.value = function(f"glCreate{kind}", ctypes.c_uint, *(ctypes.c_uint for _ in words))(*words)
        function(f"glDelete{kind}", None, ctypes.c_uint)(one)
    else:
        plural = kind.replace("Query", "Querie") + "s"
        for verb in ("Gen", "Delete"):
            function(f"gl{verb}{plural}", None, ctypes.c_int, ctypes.c_void_p)(1, ctypes.addressof(one))
    is_one = function(f"glIs{kind}", ctypes.c_ubyte, ctypes.c_uint)
    found = name = 0
    last = (
        one.value
    )  # a driver that goes on counting has none beyond it, and one that does not gives the first free one
    while name < last + UNUSED:
        name += 1
        if is_one(name):
            found, last = found + 1, max(name, last)
    return found
