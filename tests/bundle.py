"""Build the application, and use it as someone without Python would: python tests/bundle.py [DIR].

Needs the extra `bundle`, Xvfb and xdotool, and takes some two minutes. Its status is not 0 if something is wrong.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))


def try_out(program: Path, folder: Path) -> None:
    """Render with it, also by its own processes, and open its window.

    Raises:
        AssertionError: if it does not what the source does.
    """
    environment = {"HOME": str(folder), "PATH": "/usr/bin:/bin", "TMPDIR": str(folder)}

    def run(*words: object, **more: str) -> str:
        ran = subprocess.run(
            [program, *map(str, words)], env=environment | more, capture_output=True, text=True, timeout=300
        )
        assert ran.returncode == 0, f"{words}: {ran.stdout}{ran.stderr}"
        return ran.stdout

    print(run("--version").strip())
    print(run("doctor"))
    pictures = [folder / name for name in ("one.png", "two.png")]
    for picture in pictures:
        picture.write_bytes((ROOT / "assets/pictures/coffee.png").read_bytes())
    run("render", "coffee", *pictures, "--jobs", "2", "--grid", "64", "-o", folder / "by-two")
    run("render", "coffee", pictures[0], "--grid", "64", "-o", folder / "alone.png")
    run("render", "coffee", pictures[0], "--grid", "64", "--size", "256", "-o", folder / "moving.mp4")
    subprocess.run(
        [sys.executable, "-m", "app.cli", "render", "coffee", pictures[0], "--grid", "64", "-o", folder / "source.png"],
        cwd=ROOT,
        check=True,
    )
    wanted = (folder / "source.png").read_bytes()
    for name in ("alone.png", "by-two/one.png", "by-two/two.png"):
        assert (folder / name).read_bytes() == wanted, f"{name} is not what the source renders"
    show(program, pictures[0], environment)


def show(program: Path, picture: Path, environment: dict[str, str]) -> None:
    """Open its window on a picture and close it again."""
    display = f":{90 + os.getpid() % 100}"
    server = subprocess.Popen(["Xvfb", display, "-screen", "0", "1280x800x24"], stderr=subprocess.DEVNULL)
    there = environment | {"DISPLAY": display}
    try:
        editor = subprocess.Popen([program, picture], env=there)
        try:
            found = ""
            for _ in range(60):
                time.sleep(1)
                assert editor.poll() is None, f"the editor ended with status {editor.returncode}"
                asked = ["xdotool", "search", "--onlyvisible", "--name", f"{picture.stem} - "]
                if found := subprocess.run(asked, env=there, capture_output=True, text=True).stdout.strip():
                    break
            assert found, f"no window named after {picture.stem} within a minute"
            print(f"its window: {found}")
        finally:
            editor.terminate()
            editor.wait(30)
    finally:
        server.terminate()
        server.wait()


if __name__ == "__main__":
    from assets.desktop.build import build

    with tempfile.TemporaryDirectory() as temporary:
        target = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else Path(temporary) / "dist"
        used = Path(temporary) / "used"
        used.mkdir()
        try_out(build(target) / "fluidwarp", used)
