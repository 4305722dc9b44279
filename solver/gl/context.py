"""One GL 3.3 context: found with or without a window, its limits, its framebuffers."""

from __future__ import annotations

import ctypes.util
import os
import re
import sys
import threading
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import moderngl

from solver.gl.fences import Fences
from solver.gl.timing import Timings

INSTALL_HINT = "on Debian or Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri"
GPU = "FLUIDWARP_GPU"
"""The variable of the environment that says which graphics device is drawn on without a window."""
MOST_GPUS = 99_999


class ContextError(RuntimeError):
    """No usable OpenGL 3.3; the message says why and what to install."""


class NoSuchDevice(ContextError):
    """There are no more than `there` graphics devices, and another one was asked for."""

    def __init__(self, asked: int, there: int) -> None:
        numbers = "none" if there == 0 else "only 0" if there == 1 else f"0 to {there - 1}"
        super().__init__(f"graphics device {asked} is not there; there is {numbers}")
        self.there = there


@contextmanager
def making() -> Iterator[None]:
    """Make objects of GL in the block. Raises `ContextError` where the driver gives none: it was reset, or crashed."""
    try:
        yield
    except moderngl.Error as error:
        if not str(error).startswith("cannot create"):
            raise
        raise ContextError(
            "the graphics driver has stopped working; start fluidwarp again; if it happens again, update the driver"
        ) from error


@dataclass(frozen=True)
class Limits:
    """What this GL can do: names, version and the sizes that bound us."""

    vendor: str
    renderer: str
    version: str
    max_texture_size: int
    max_draw_buffers: int
    max_texture_units: int

    @property
    def is_software(self) -> bool:
        """True on a software rasteriser, where instructions cost more than passes."""
        return any(name in self.renderer.lower() for name in ("llvmpipe", "softpipe", "swiftshader"))


def _standalone_contexts(gpu: int | None) -> Iterator[dict[str, Any]]:
    """How a context without a window can be asked for on this system, the best first; only EGL can choose a device."""
    if not sys.platform.startswith("linux"):
        yield {}  # WGL on Windows, CGL on macOS
        return
    chosen = {} if gpu is None else {"device_index": gpu}
    yield {"backend": "egl", **chosen}
    if ctypes.util.find_library("EGL"):
        # Without the -dev packages only the versioned names exist.
        yield {"backend": "egl", "libegl": "libEGL.so.1", "libgl": "libGL.so.1", **chosen}
    if gpu is None and os.environ.get("DISPLAY"):
        yield {"libgl": "libGL.so.1", "libx11": "libX11.so.6"}  # GLX


def _chosen_gpu() -> int | None:
    """The graphics device that the environment asks for. Raises `ContextError` where that is no number."""
    said = os.environ.get(GPU, "")
    if not said:
        return None
    if not (said.isascii() and said.isdecimal()) or len(said) > 5:
        raise ContextError(f"graphics device {said!r} was asked for; it must be a number from 0 to {MOST_GPUS}")
    if not sys.platform.startswith("linux"):
        raise ContextError(f"graphics device {said} was asked for; on this system its own settings choose the device")
    return int(said)


def _most_memory() -> int | None:
    """Bytes of addresses that this process may have; None where that is not limited, or not known."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if most == resource.RLIM_INFINITY else most


class Context:
    """One GL context, what it can do, and the framebuffers on its textures.

    Args:
        ctx: a moderngl context, GL 3.3 core or later; use `headless()` where there is no window.

    Attributes:
        watch: called before each pass, and may raise: what is being drawn is then given up, as a whole simulation.
    """

    _current: ClassVar[Context | None] = None  # whose context is
    _forks: ClassVar[int] = 0  # that led to this process

    def __init__(self, ctx: moderngl.Context, owns_context: bool = False) -> None:
        self.ctx = ctx
        self._made_in = threading.get_ident(), Context._forks
        self._owns_context = owns_context
        Context._current = self  # as a new one is
        info = ctx.info
        self.limits = Limits(
            vendor=str(info["GL_VENDOR"]),
            renderer=str(info["GL_RENDERER"]),
            version=str(info["GL_VERSION"]),
            max_texture_size=int(info["GL_MAX_TEXTURE_SIZE"]),
            max_draw_buffers=int(info["GL_MAX_DRAW_BUFFERS"]),
            max_texture_units=int(info["GL_MAX_TEXTURE_IMAGE_UNITS"]),
        )
        self.timings = Timings(ctx)
        self.watch: Callable[[], None] | None = None
        # Without threads of its own llvmpipe draws in ours, and no other holds a fence.
        has_threads = os.environ.get("LP_NUM_THREADS") != "0"
        self.fences = Fences(ctx, needed=has_threads and "llvmpipe" in self.limits.renderer.lower())
        # By the textures that they hold; and which each texture is in.
        self._targets: dict[tuple[moderngl.Texture, ...], moderngl.Framebuffer] = {}
        self._targets_of: defaultdict[moderngl.Texture, set[tuple[moderngl.Texture, ...]]] = defaultdict(set)
        self._rest = ctx.simple_framebuffer((1, 1))
        # Reads a texture between its texels, where a look is enough.
        self.linear = ctx.sampler(repeat_x=False, repeat_y=False, filter=(moderngl.LINEAR, moderngl.LINEAR))
        # Python may collect garbage on any thread, and while another context is current: see `collect`.
        ctx.gc_mode = "context_gc"
        ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)

    @classmethod
    def headless(cls) -> Self:
        """One of its own, with no window: through EGL on Linux, through the system's own way elsewhere.

        Which of several devices EGL takes, the variable `GPU` of the environment says; processes that are started
        inherit it.

        Raises:
            ContextError: if there is no OpenGL 3.3 driver; the message says what was tried and what to install.
            NoSuchDevice: if there are fewer devices.
        """
        gpu, reasons = _chosen_gpu(), list[str]()
        for settings in _standalone_contexts(gpu):
            try:
                ctx = moderngl.create_context(require=330, standalone=True, **settings)
            except Exception as error:  # glcontext raises plain Exception
                if gpu is not None and (found := re.search(r"but found (\d+) device", str(error))):
                    raise NoSuchDevice(gpu, int(found[1])) from None
                reasons.append(str(error))
            else:
                return cls(ctx, owns_context=True)
        hint = f"; {INSTALL_HINT}" if sys.platform.startswith("linux") else ""
        where = "" if gpu is None else f" on graphics device {gpu}"
        if (most := _most_memory()) is not None:
            little = "which may be too little for a driver"
            hint = f"; this process may have {most >> 20} MB of memory (ulimit -v), {little}"
        raise ContextError(f"no OpenGL 3.3 without a window{where} ({', '.join(dict.fromkeys(reasons))}){hint}")

    def framebuffer(self, textures: tuple[moderngl.Texture, ...]) -> moderngl.Framebuffer:
        """The framebuffer that draws into several textures at once, kept until one of them is released."""
        target = self._targets.get(textures)
        if target is None:
            with making():
                target = self._targets[textures] = self.ctx.framebuffer(textures)
            for texture in textures:
                self._targets_of[texture].add(textures)
        return target

    def forget_targets(self, texture: moderngl.Texture) -> None:
        """Drop the framebuffers that hold a texture, because it is being released."""
        # moderngl binds the last framebuffer again after making a new one: an error in GL if that one is gone.
        self.use()
        self._rest.use()
        for textures in self._targets_of.pop(texture, ()):
            self._targets.pop(textures).release()
            for other in set(textures) - {texture}:
                self._targets_of[other].remove(textures)

    def collect(self) -> None:
        """Free the GL objects that Python has dropped."""
        self.use()
        objects = self.ctx.objects
        if objects:
            self._rest.use()
        while objects:
            item = objects.popleft()
            if not isinstance(item, moderngl.InvalidObject):  # released before
                item.release()

    def use(self) -> None:
        """Make its context the current one, if another device's was used last; to be called before any drawing.

        Raises:
            ContextError: if it was released, or made in another thread or process: GL draws nothing there, or hangs.
        """
        if (threading.get_ident(), Context._forks) != self._made_in:
            raise ContextError("a device works only in the thread and the process that made it; make one in each")
        if Context._current is not self:
            if isinstance(self.ctx.mglo, moderngl.InvalidObject):
                raise ContextError("the device was released")
            self.ctx.__enter__()
            Context._current = self

    # -- its life ---------------------------------------------------------------------------------------------------

    def stage(self, name: str) -> AbstractContextManager[object]:
        """Count and, when `timings.enabled`, time everything drawn inside under the stage's name."""
        return self.timings.stage(name)

    def release(self) -> None:
        """Give the context back, if it is ours; nothing made in it can be used afterwards."""
        if self._owns_context and not isinstance(self.ctx.mglo, moderngl.InvalidObject):
            self.use()
            self.ctx.release()
            Context._current = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def _after_fork() -> None:
    Context._forks += 1  # the threads that draw for a context have stayed behind


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
