"""What this machine has of what fluidwarp needs, and what to install otherwise."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import app

PATIENCE = 30  # seconds
MISSING = "missing"
LIBRARIES = (
    *("moderngl", "glfw", "imgui-bundle", "numpy", "scipy", "pydantic", "tomlkit", "platformdirs"),
    *("pillow", "imagecodecs", "tifffile", "openexr", "imageio", "imageio-ffmpeg"),
)


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        name: what it is.
        said: what was found.
        mend: what to do about it, or "" if it is well.
        vital: nothing works without it.
    """

    name: str
    said: str
    mend: str = ""
    vital: bool = False

    @property
    def is_well(self) -> bool:
        return not self.mend


def examine() -> Iterator[Finding]:
    """Look at everything, one thing after another; the GL is tried in processes of its own, which may die of it."""
    yield Finding("Python", f"{platform.python_version()} on {platform.system()} {platform.machine()}")
    versions = {name: _version(name) for name in LIBRARIES}
    missing = " ".join(name for name, version in versions.items() if version == MISSING)
    found = ", ".join(f"{name} {version}" for name, version in versions.items())
    yield Finding("libraries", found, f"pip install {missing}" if missing else "", vital=True)
    yield from _headless()
    yield _window()
    yield _encoder()


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return MISSING


def _headless() -> Iterator[Finding]:
    found = ask("app.doctor")
    if "error" in found:
        asked = os.environ.get("FLUIDWARP_GPU")
        mend = "give FLUIDWARP_GPU another number, or none" if asked else "install what is named above"
        yield Finding("OpenGL without a window", found["error"], mend, vital=True)
        yield from devices()
        return
    yield Finding("OpenGL without a window", f"{found['version']}, {found['renderer']} ({found['vendor']})")
    yield Finding(
        "limits",
        f"textures up to {found['max_texture_size']} x {found['max_texture_size']}, "
        f"{found['max_draw_buffers']} draw buffers, {found['max_texture_units']} texture units",
    )
    if found["is_software"]:
        yield Finding("speed", "no GPU is used: everything works, at the speed of the processor")
    yield from devices()


def devices() -> Iterator[Finding]:
    """Each graphics device that `--gpu` can choose, tried in a process of its own."""
    try:
        from solver.gl.context import GPU, MOST_GPUS
    except ImportError:  # as has been told
        return
    for number in range(ask("app.doctor", **{GPU: str(MOST_GPUS)}).get("devices", 0)):
        found = ask("app.doctor", **{GPU: str(number)})
        said = found.get("error") or f"{found['renderer']} ({found['vendor']})"
        yield Finding(f"--gpu {number}", said, "choose another device" if "error" in found else "")


def _window() -> Finding:
    session = ", ".join(f"{name}={os.environ[name]}" for name in ("WAYLAND_DISPLAY", "DISPLAY") if os.environ.get(name))
    if not session and sys.platform.startswith("linux"):
        return Finding(
            "window",
            "no display: neither WAYLAND_DISPLAY nor DISPLAY is set",
            "log in to a desktop for `fluidwarp edit`; `fluidwarp render` needs none",
        )
    found = ask("app.ui.probe")
    if "error" not in found:
        return Finding("window", f"{found['platform']}, OpenGL {found['opengl']}")
    words = found["error"]
    if "imgui" in words or "libX11" in words or "libXext" in words:
        mend = "on Debian or Ubuntu: apt-get install libx11-6 libxext6"
    elif "GL" in words:
        mend = "on Debian or Ubuntu: apt-get install libgl1 libgl1-mesa-dri, or a driver with OpenGL 3.3"
    else:
        mend = f"check that the display is there ({session})"
    return Finding("window", words, mend)


def _encoder() -> Finding:
    try:
        import imageio_ffmpeg

        return Finding("video", f"ffmpeg {imageio_ffmpeg.get_ffmpeg_version()}")
    except Exception as error:
        return Finding("video", str(error), "pip install --force-reinstall imageio-ffmpeg")


def ask(module: str, **environment: str) -> dict:
    """What `python -m module` prints as JSON, or {"error": why it did not}."""
    environment = {
        **os.environ, "PYTHONPATH": os.pathsep.join([str(Path(app.__path__[0]).parent), *filter(None, sys.path)]),
        "EGL_LOG_LEVEL": "warning", **environment
    }  # fmt: skip
    try:
        ran = subprocess.run(
            [sys.executable, "-m", module], capture_output=True, text=True, timeout=PATIENCE, env=environment
        )
    except subprocess.TimeoutExpired:
        return {"error": f"no answer within {PATIENCE} s"}
    said = ran.stderr.strip().splitlines()[-1:]
    if ran.returncode:
        return {"error": (said or [f"it ended with status {ran.returncode}"])[0]}
    found = json.loads(ran.stdout)
    if "error" in found and said:
        found["error"] += f"; the driver says: {said[0]}"
    return found


def _probe_headless() -> dict:
    from dataclasses import asdict

    from solver.gl.context import ContextError, NoSuchDevice
    from solver.gl.device import Device

    try:
        with Device.headless() as device:
            return asdict(device.limits) | {"is_software": device.limits.is_software}
    except ContextError as error:
        return {"error": str(error)} | ({"devices": error.there} if isinstance(error, NoSuchDevice) else {})


if __name__ == "__main__":
    json.dump(_probe_headless(), sys.stdout)
