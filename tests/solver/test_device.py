"""Contexts without a window: through EGL, through the system's own way, on another driver, and where there is none."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

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
