"""No draw lets llvmpipe free a fence that one of its threads still holds."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

DRAWING = """
from time import sleep
from solver.gl.device import Device
from solver.gl.tiled import TiledField
with Device.headless() as device:
    assert "llvmpipe" in device.limits.renderer
    source, copy = device.field((27, 27), 2), device.pass_("gl/copy.frag")
    targets = [TiledField(device, (27, 27), 2, "target", tile=16) for _ in range(4)]
    blank = targets[0].save()
    for _ in range(150):
        for target in targets:
            {what}
        sleep(0.0005)
    device.ctx.finish()
"""


HOLDING = """
from solver.gl.device import Device
from support.resources import resident
with Device.headless() as device:
    assert "llvmpipe" in device.limits.renderer
    field = device.field((8, 8), 2)
    for number in range(1000):
        for _ in range(250):
            device.fences.hold()
        field.clear()
        if number == 100:
            before = resident()
    print(resident() - before)
"""


@pytest.fixture(scope="module")
def late_threads(tmp_path_factory: pytest.TempPathFactory) -> Path:
    library = tmp_path_factory.mktemp("late") / "late_threads.so"
    text = ROOT / "tests" / "support" / "late_threads.c"
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", library, text, "-ldl"], check=True)
    return library


@pytest.mark.skipif(
    sys.platform != "linux" or (not shutil.which("cc") and "CI" not in os.environ), reason="needs a C compiler"
)
@pytest.mark.parametrize(
    "what",
    [
        "copy(target, field=source, offset=(0, 0))",
        "copy(target, field=source, offset=(0, 0), region=[(0, 0, 3, 3), (9, 9, 3, 3)])",
        "copy.draw_into(target.framebuffer, field=source, offset=(0, 0))",
        "target.clear(1.0)",
        "target.before_drawing((0, 0, 1, 1)); target.restore(blank)",
    ],
)
def test_a_fence_outlives_its_signal(late_threads: Path, what: str):
    chosen = {"GALLIUM_DRIVER": "llvmpipe", "LIBGL_ALWAYS_SOFTWARE": "1", "LP_NUM_THREADS": "2"}
    environment = os.environ | chosen | {"LD_PRELOAD": str(late_threads), "PYTHONPATH": str(ROOT)}
    ran = subprocess.run(
        [sys.executable, "-c", DRAWING.format(what=what)], capture_output=True, text=True, env=environment
    )
    assert ran.returncode == 0, ran.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="the memory of a process is asked of Linux")
def test_of_many_fences_the_last_ones_alone_are_kept() -> None:
    """225,000 of them, of some hundred bytes each."""
    path = os.pathsep.join(map(str, (ROOT, ROOT / "tests")))
    chosen = {"GALLIUM_DRIVER": "llvmpipe", "LIBGL_ALWAYS_SOFTWARE": "1", "LP_NUM_THREADS": "2", "PYTHONPATH": path}
    ran = subprocess.run(
        [sys.executable, "-c", HOLDING], capture_output=True, text=True, env=os.environ | chosen, timeout=300
    )
    assert ran.returncode == 0, ran.stderr
    assert int(ran.stdout) < 2**23  # about 1 MB is taken, and 20 to 28 MB where all of them are kept
