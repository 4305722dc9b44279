"""Build fluidwarp as a folder that runs without Python: python -m assets.desktop.build [DIR], default dist.

Needs PyInstaller and fluidwarp in the environment (`pip install -e .[bundle]`). A program is built on the system that
it is for; Linux is what has been tried, macOS and Windows have not been run yet.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
WITH_THE_LINUX_ONE = ("fluidwarp.desktop", "fluidwarp.xml", "fluidwarp.svg", "install.sh")
# What is found by name at run time, so that looking at the imports does not see it.
PACKAGES = ("app", "solver", "shaders", "assets", "glfw", "imgui_bundle", "imagecodecs", "glcontext", "rich")
# What imgui_bundle and others can also be used with.
UNUSED = (
    "matplotlib",
    "cv2",
    "distributed",
    "dask",
    "tkinter",
    "IPython",
    "pandas",
    "numba",
    "pytest",
    "PyQt5",
)


def build(folder: Path) -> Path:
    """Build the program under `folder`; returns its own folder."""
    words = [f"--collect-all={name}" for name in PACKAGES] + ["--recursive-copy-metadata=fluidwarp"]
    words += [f"--exclude-module={name}" for name in UNUSED]
    subprocess.run(
        [
            sys.executable, "-m", "PyInstaller", "--noconfirm", "--clean", "--onedir",
            "--name=fluidwarp", "--log-level=WARN",
            f"--distpath={folder}", f"--workpath={folder / 'build'}", f"--specpath={folder / 'build'}", *words,
            str(HERE / "start.py"),
        ],
        check=True,
    )  # fmt: skip
    shutil.rmtree(folder / "build")
    program = folder / "fluidwarp"
    if sys.platform.startswith("linux"):
        for name in WITH_THE_LINUX_ONE:
            shutil.copy2(HERE / name, program)
    return program


if __name__ == "__main__":
    print(build(Path(sys.argv[1] if len(sys.argv) > 1 else "dist").resolve()))
