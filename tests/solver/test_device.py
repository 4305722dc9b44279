"""Contexts without a window: through EGL, through the system's own way, on another driver, and where there is none."""

from __future__ import annotations

import ctypes
import gc
import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from PIL import Image

from solver.gl.context import GPU, ContextError, NoSuchDevice
from solver.gl.device import MOST_PASSES, Device
from solver.gl.field import Field, FieldPool
from solver.gl.passes import Pass, Region
from solver.gl.program import compile_program
from solver.gl.reduction import Reduction
from solver.gl.tiled import TiledField
from support.gl_objects import living

ROOT = Path(__file__).parents[2]
NO_EGL = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nowhere.json"}  # the loader is there, but no driver for it

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="EGL and X11 are Linux's")

RECIPE = """
version = 1
picture = "{picture}"
duration = 0.3
[fluid]
grid = 32
[[force]]
kind = "vortex"
point = [0.47, 0.33]
radius = 0.3
strength = 7.0
at = 0.0
[[viscosity]]
kind = "picture"
scale = 0.5
"""


def limits(**environment: str) -> dict:
    """What `python -m app.doctor` finds in an environment."""
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"} | environment
    ran = subprocess.run(
        [sys.executable, "-m", "app.doctor"], capture_output=True, text=True, cwd=ROOT, env=environment
    )
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


def test_limits_are_what_opengl_tells(device: Device):
    told, limits = device.ctx.info, device.limits
    assert (limits.vendor, limits.renderer, limits.version) == tuple(
        told[f"GL_{name}"] for name in ("VENDOR", "RENDERER", "VERSION")
    )
    assert limits.max_texture_size == told["GL_MAX_TEXTURE_SIZE"]
    assert limits.max_draw_buffers == told["GL_MAX_DRAW_BUFFERS"]
    assert limits.max_texture_units == told["GL_MAX_TEXTURE_IMAGE_UNITS"]


@linux
def test_without_egl_and_without_a_display_the_message_says_what_to_install():
    error = limits(**NO_EGL)["error"]
    assert "no OpenGL 3.3 without a window" in error
    assert "apt-get install" in error


@linux
def test_without_egl_the_display_serves():
    command = ["Xvfb", "-displayfd", "1", "-screen", "0", "64x64x24", "-nolisten", "tcp"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as screen:
        assert screen.stdout is not None
        try:
            found = limits(DISPLAY=f":{int(screen.stdout.readline())}", **NO_EGL)
        finally:
            screen.terminate()
    assert found["max_texture_size"] >= 4096


@linux
def test_a_device_that_is_not_there_is_named_with_those_that_are(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(GPU, "99999")
    with pytest.raises(NoSuchDevice, match=r"^graphics device 99999 is not there; there is (only 0|0 to \d+)$") as told:
        Device.headless()
    assert told.value.there >= 1
    assert str(NoSuchDevice(2, 2)).endswith("there is 0 to 1")
    assert str(NoSuchDevice(0, 0)).endswith("there is none")


@linux
def test_doctor_hears_how_many_devices_there_are_where_one_is_not():
    found = limits(**{GPU: "99999"})
    assert found["error"].startswith("graphics device 99999 is not there; there is ")
    assert found["devices"] >= 1


@linux
@pytest.mark.parametrize(("asked", "wanted"), [("", None), ("0", 0), ("1", 1)])
def test_the_environment_chooses_the_device(monkeypatch: pytest.MonkeyPatch, asked: str, wanted: int | None):
    """Each way to a context is asked for it, and none is taken that could not choose."""
    tried: list[dict[str, Any]] = []

    def refuse(**settings: Any) -> None:
        tried.append(settings)
        raise Exception("eglInitialize failed (0x3001)")

    monkeypatch.setattr(moderngl, "create_context", refuse)
    monkeypatch.setenv(GPU, asked)
    monkeypatch.setenv("DISPLAY", ":9")
    with pytest.raises(ContextError, match="eglInitialize failed") as told:
        Device.headless()
    assert {settings.get("device_index") for settings in tried} == {wanted}
    assert any(settings.get("backend") is None for settings in tried) == (wanted is None)
    assert (f"on graphics device {wanted}" in str(told.value)) == (wanted is not None)


@pytest.mark.parametrize("asked", ["-1", "one", "100000", "9" * 5000])
def test_what_is_no_device_is_refused(monkeypatch: pytest.MonkeyPatch, asked: str):
    monkeypatch.setenv(GPU, asked)
    with pytest.raises(ContextError, match="must be a number from 0 to 99999"):
        Device.headless()


def test_no_device_is_chosen_where_the_system_does(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(GPU, "0")
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(ContextError, match="on this system its own settings choose"):
        Device.headless()


# The command line, which tells what it draws with.
TELLING = """
from app.cli import main
from solver.gl.device import Device
headless = Device.headless
def telling(kind):
    device = headless()
    print(device.limits.renderer)
    return device
Device.headless = classmethod(telling)
main()
"""


@linux
def test_another_driver_gives_the_same_picture(tmp_path: Path):
    """Mesa's reference rasteriser shares no code generator with the one that is used where there is no GPU."""
    recipe = tmp_path / "recipe.toml"
    with Image.open(ROOT / "assets" / "pictures" / "coffee.png") as coffee:
        coffee.resize((180, 120)).save(tmp_path / "coffee.png")
    recipe.write_text(RECIPE.format(picture=tmp_path / "coffee.png"), "utf-8")
    pictures = []
    for driver in ("llvmpipe", "softpipe"):
        chosen = {"GALLIUM_DRIVER": driver, "LIBGL_ALWAYS_SOFTWARE": "1"}
        environment = os.environ | chosen | {"PYTHONPATH": str(ROOT)}
        words = [sys.executable, "-c", TELLING, "render", str(recipe), "-o", f"{driver}.png", "--size", "120"]
        ran = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, env=environment)
        assert ran.returncode == 0, ran.stderr
        assert driver in ran.stdout
        pictures.append(np.asarray(Image.open(tmp_path / f"{driver}.png")).astype(int))
    assert abs(pictures[0] - pictures[1]).max() <= 1
    assert pictures[0].std() > 20


# So little memory that a software rasteriser, which has its textures there, runs out of it as a card does.
FULL = """
import resource, sys
from pathlib import Path
from app.cli import main
from solver.gl.device import Device
from solver.gl.field import GraphicsMemoryError

def limited(kind, headless=Device.headless):
    device = headless()
    device.field((64, 64), 1, "before")
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + 600 * 2**20
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    return device
"""
FILLING = """
device, kept = limited(None), []
try:
    for number in range(99):
        kept.append(device.field((2048, 2048), 4, str(number)))
except GraphicsMemoryError as error:
    print(error)
assert kept
kept.pop().release()
assert device.field((1024, 1024), 4, "after").get().sum() == 0
"""
RENDERING = """
Device.headless = classmethod(limited)
sys.argv = ["fluidwarp", "render", "coffee", "-o", "full.png", "--grid", "4096"]
main()
"""


@linux
def test_full_graphics_memory_is_told_and_what_is_given_back_can_be_used(tmp_path: Path):
    environment = os.environ | {"PYTHONPATH": str(ROOT), "LIBGL_ALWAYS_SOFTWARE": "1"}
    for script, status, told in ((FILLING, 0, "there is no room for 2048 x 2048 x 4 more"), (RENDERING, 1, "")):
        command = [sys.executable, "-c", FULL + script]
        ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=environment)
        assert (ran.returncode, ran.stdout.strip()) == (status, told), ran.stderr
    assert ran.stderr == "fluidwarp: there is not enough memory; try a smaller --size or --grid\n"
    assert not list(tmp_path.iterdir())


def test_a_field_that_is_dropped_leaves_nothing_behind_and_a_list_needs_no_framebuffer(device: Device):
    kinds = "Texture", "Framebuffer"
    before = living(device, *kinds)
    for _ in range(3):
        device.field((64, 64), 4).get()
    assert living(device, *kinds) == before
    listed = device.upload(np.ones((2, 3), np.float32))
    assert living(device, "Framebuffer") == {"Framebuffer": before["Framebuffer"]}
    assert (listed.get() == 1).all()
    assert living(device, "Framebuffer") == {"Framebuffer": before["Framebuffer"] + 1}
    listed.release()
    assert living(device, *kinds) == before


def test_of_many_passes_those_used_last_stay_compiled_and_the_others_are_compiled_again():
    with Device.headless() as device:
        field, source = device.field((2, 2)), device.upload(np.full((2, 2), 3, np.float32))

        def copied(number: int) -> Pass:
            field.clear()
            copy = device.pass_("gl/copy.frag", NUMBER=number)
            copy(field, field=source, offset=(0.0, 0.0))
            assert (field.get() == 3).all()
            return copy

        first, held = copied(0), copied(1)
        before = living(device, "Program", "Framebuffer", "VertexArray")
        for number in range(2, MOST_PASSES):
            copied(number)
            assert copied(0) is first
        full = living(device, *before)
        assert full["Program"] == before["Program"] + MOST_PASSES - 2
        copied(MOST_PASSES)
        assert copied(0) is first, "the one that was made first has been used after all others"
        for number in range(MOST_PASSES + 1, 2 * MOST_PASSES + 1):
            copied(number)
        assert living(device, *before) == full + Counter({"Program": 2, "VertexArray": 2})  # these two are held here
        field.clear()
        held(field, field=source, offset=(0.0, 0.0))
        assert (field.get() == 3).all()
        assert copied(0) is not first


def test_a_field_of_a_pool_is_another_where_anything_of_it_is(device: Device) -> None:
    pool = FieldPool(device, "pool")
    field = pool.get("role", (4, 3), 1)
    assert pool.get("role", (4, 3), 1) is field
    for size, components, dtype in (((3, 4), 1, "f4"), ((3, 4), 2, "f4"), ((3, 4), 2, "f1")):
        other = pool.get("role", size, components, dtype)
        assert (other.size, other.components, other.dtype) == (size, components, dtype)
    pool.release()


@linux
def test_a_driver_that_has_stopped_is_told_as_that_and_not_as_a_bug(device: Device):
    """Without a context that answers, as after a reset, GL gives no more objects; shaders seemed not to compile."""
    egl = ctypes.CDLL("libEGL.so.1")
    names = ("eglGetCurrentDisplay", "eglGetCurrentContext", "eglGetCurrentSurface")
    for name in names:
        getattr(egl, name).restype = ctypes.c_void_p
    egl.eglMakeCurrent.argtypes = [ctypes.c_void_p] * 4
    device.use()
    kept = device.field((4, 4))
    display, context, surface = (getattr(egl, name)(0x3059) for name in names)  # EGL_DRAW, for the last of them
    assert context
    made = (
        lambda: device.field((8, 8)),
        lambda: kept.framebuffer,
        lambda: device.framebuffer((kept.texture, kept.texture)),
        lambda: compile_program(device.ctx, "step/scale.frag", {}),
    )
    kept.__dict__.pop("framebuffer", None)
    egl.eglMakeCurrent(display, None, None, None)
    try:
        for make in made:
            with pytest.raises(ContextError, match="the graphics driver has stopped working; start fluidwarp again"):
                make()
    finally:
        egl.eglMakeCurrent(display, surface, surface, context)
    kept.release()


@pytest.fixture(scope="module")
def second() -> Iterator[Device]:
    with Device.headless() as second:
        for number in range(20):  # so that the next has another OpenGL name than the next of the other device
            second.pass_("gl/copy.frag", NUMBER=number)
        yield second


def dropped(device: Device, other: Device) -> Callable[[], object]:
    """What Python drops while another device is in use, which has textures of the same names, is given back later."""
    fields = [device.upload(GIVEN) for _ in range(5)]
    other.use()
    fields.clear()
    gc.collect()
    return device.collect


def cleared(field: Field) -> Callable[[], object]:
    def clear() -> None:
        field.clear(3.0)
        np.testing.assert_array_equal(field.get(), 3)
        field.set(GIVEN)

    return clear


def copied(device: Device, field: Field) -> Callable[[], object]:
    target = device.field((4, 3))

    def copy() -> None:
        target.copy_from(field)
        np.testing.assert_array_equal(target.get(), GIVEN)
        target.release()

    return copy


def drawn_into(device: Device, field: Field) -> Callable[[], object]:
    """A framebuffer that is not a field's, as a window's."""
    target, copy = device.field((4, 3)), device.pass_("gl/copy.frag")
    framebuffer = target.framebuffer

    def draw() -> None:
        copy.draw_into(framebuffer, field=field, offset=(0.0, 0.0))
        np.testing.assert_array_equal(target.get(), GIVEN)
        target.release()

    return draw


def drawn(device: Device, field: Field) -> Callable[[], object]:
    target, copy = device.field(field.size), device.pass_("gl/copy.frag")

    def draw() -> None:
        copy(target, field=field, offset=(0.0, 0.0))
        np.testing.assert_array_equal(target.get(), GIVEN)
        target.release()

    return draw


def read(field: Field, region: Region | None = None) -> Callable[[], object]:
    left, top, width, height = region or (0, 0, 4, 3)
    wanted = GIVEN[top : top + height, left : left + width]
    return lambda: np.testing.assert_array_equal(field.get(region), wanted)


def summed(device: Device) -> Callable[[], object]:
    field, sums = device.upload(np.ones((3, 100), np.float32)), Reduction(device, (100, 3), 1, "sum")
    return lambda: np.testing.assert_array_equal(sums(field), 300)


def saved(device: Device, blank: bool) -> Callable[[], object]:
    tiled = TiledField(device, (600, 300), 2, "tiled")
    if not blank:
        tiled.clear(1.0, 2.0)
    kept = tiled.save()
    tiled.clear(5.0, 6.0)

    def restore() -> None:
        tiled.restore(kept)
        kept.release()
        np.testing.assert_array_equal(tiled.get((599, 299, 1, 1)), [[[0.0, 0.0] if blank else [1.0, 2.0]]])
        tiled.release()

    return restore


def compiled(device: Device, field: Field) -> Callable[[], object]:
    target = device.field((4, 3))

    def make() -> None:
        copy = device.pass_("gl/copy.frag", NUMBER=77)
        copy(target, field=field, offset=(0.0, 0.0))
        np.testing.assert_array_equal(target.get(), GIVEN)
        target.release()

    return make


def framed(device: Device) -> Callable[[], object]:
    uploaded = device.upload(GIVEN)

    def frame() -> None:
        assert uploaded.framebuffer.size == (4, 3)
        np.testing.assert_array_equal(uploaded.get(), GIVEN)
        uploaded.release()

    return frame


def put_together(device: Device) -> Callable[[], object]:
    """A framebuffer of two textures is forgotten with the first of them."""
    one, other = device.upload(GIVEN), device.upload(GIVEN)
    device.framebuffer((one.texture, other.texture))

    def release() -> None:
        one.release()
        np.testing.assert_array_equal(other.get(), GIVEN)
        other.release()

    return release


GIVEN = np.arange(12, dtype=np.float32).reshape(3, 4)
USES: dict[str, Callable[[Device, Field, Device], Callable[[], object]]] = {
    "made": lambda device, field, other: lambda: device.field((4, 3)).get(),
    "uploaded": lambda device, field, other: lambda: device.upload(GIVEN + 1),
    "read": lambda device, field, other: read(field),
    "read in part": lambda device, field, other: read(field, (1, 1, 2, 1)),
    "set": lambda device, field, other: lambda: field.set(GIVEN),
    "set in part": lambda device, field, other: lambda: field.set(GIVEN[1:2, 1:3], (1, 1, 2, 1)),
    "cleared": lambda device, field, other: cleared(field),
    "drawn": lambda device, field, other: drawn(device, field),
    "compiled": lambda device, field, other: compiled(device, field),
    "made a framebuffer of": lambda device, field, other: framed(device),
    "drawn elsewhere": lambda device, field, other: drawn_into(device, field),
    "copied": lambda device, field, other: copied(device, field),
    "released": lambda device, field, other: device.upload(GIVEN).release,
    "put together": lambda device, field, other: put_together(device),
    "dropped": lambda device, field, other: dropped(device, other),
    "summed": lambda device, field, other: summed(device),
    "saved": lambda device, field, other: saved(device, False),
    "saved empty": lambda device, field, other: saved(device, True),
}


@pytest.mark.parametrize("use", USES)
def test_whatever_is_done_with_a_device_is_done_in_its_own_context(device: Device, second: Device, use: str) -> None:
    """Another one was used last, and has as many fields, of the same names to OpenGL: it keeps what is in them."""
    field, theirs = device.upload(GIVEN), [second.upload(GIVEN * number) for number in range(40)]
    counted = use in ("released", "dropped", "put together", "saved", "saved empty")
    before = living(device, "Texture") if counted else None
    for one in (field, *theirs):
        one.get()  # which makes it a framebuffer
    done = USES[use](device, field, second)
    second.use()
    done()
    second.use()
    assert second.ctx.error == "GL_NO_ERROR"
    for number, their in enumerate(theirs):
        np.testing.assert_array_equal(their.get(), GIVEN * number)
        their.release()
    np.testing.assert_array_equal(field.get(), GIVEN)
    if counted:
        assert living(device, "Texture") == before
    field.release()
