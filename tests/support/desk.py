"""A virtual screen with the real editor on it, used with a real pointer and real keys."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

NEEDED = ("Xvfb", "xdotool")
PATIENCE = 90.0
SLICE = 0.01  # seconds after which an editor that is held up is looked at
SHADERS = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")

# The editor as `python -m app` starts it, but for what it does ahead and unseen: sixty ticks at each start.
UNREHEARSED = (
    "import runpy; from app.ui import rehearsal; rehearsal.PARTS = (); runpy.run_module('app', None, '__main__')"
)

needs_a_screen = pytest.mark.skipif(
    sys.platform != "linux" or (not all(map(shutil.which, NEEDED)) and "CI" not in os.environ),
    reason=f"needs {' and '.join(NEEDED)}; tests/run installs them",
)


class Desk:
    """A virtual screen with the editor on it.

    Args:
        folder: for the files of the screen, of the editor and of the test.
        size: of the screen, in pixels.
        threads: llvmpipe draws in threads of its own, as for most who use it; what that costs is told in conftest.py.
        rehearses: the editor does ahead what a hand may do first; where nothing is said, if it has threads. That is
            most of what a window costs here, where Mesa keeps what it has compiled.
    """

    def __init__(
        self, folder: Path, size: tuple[int, int] = (1280, 800), threads: bool = False, rehearses: bool | None = None
    ) -> None:
        self.folder = folder
        self._rehearses = threads if rehearses is None else rehearses
        # The server takes a display that nobody has, and tells its number once it listens.
        command = ["Xvfb", "-displayfd", "1", "-screen", "0", f"{size[0]}x{size[1]}x24", "-noreset", "-nolisten", "tcp"]
        command += ["-fbdir", str(folder)]
        self.screen = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert self.screen.stdout is not None
        number = int(self.screen.stdout.readline())
        self.env = {
            **os.environ,
            "DISPLAY": f":{number}",
            "XDG_CONFIG_HOME": str(folder / "config"),
            "XDG_STATE_HOME": str(folder / "state"),
            "HOME": str(folder),
            "PATH": os.environ["PATH"],
            # Under another home Mesa would compile every shader anew, which is most of what a window costs.
            "MESA_SHADER_CACHE_DIR": os.environ.get("MESA_SHADER_CACHE_DIR") or str(SHADERS),
            **({} if threads else {"LP_NUM_THREADS": "0"}),
        }
        self.env.pop("WAYLAND_DISPLAY", None)
        self.editor: subprocess.Popen[str] | None = None
        self.window = ""

    def open(self, file: Path, *command: str) -> None:
        """Start the editor with a file, by `command` or else by the file alone, and wait until it is open."""
        start = ("-m", "app") if self._rehearses else ("-c", UNREHEARSED)
        self.editor = subprocess.Popen(
            [sys.executable, *start, *command, str(file)],
            env=self.env,
            cwd=Path(__file__).parents[2],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.until(lambda: self.is_shown, "a window")
        self.window = next(iter(self.titles()))
        self.until(lambda: self.title() == f"{file.stem} - fluidwarp", "the file to be open")

    def open_pattern(self) -> None:
        """Start the editor with the pattern on a coarse grid, which is nobody's to choose: nothing is measured."""
        from support.editing import small_project

        recipe = small_project(self.folder).recipe.edited(picture="pattern.png")
        (self.folder / "pattern.toml").write_text(recipe.text(), "utf-8")
        self.open(self.folder / "pattern.toml")

    @property
    def is_shown(self) -> bool:
        """A window is to be seen, and not minimised."""
        return bool(self.titles())

    def titles(self) -> dict[str, str]:
        """What stands on the windows that are to be seen, by their numbers."""
        from Xlib import X
        from Xlib.error import BadWindow

        found, name = dict[str, str](), self._x.intern_atom("_NET_WM_NAME")
        for window in self._x.screen().root.query_tree().children:
            with suppress(BadWindow):  # it has just been closed
                if window.get_attributes().map_state == X.IsViewable:
                    found[str(window.id)] = window.get_full_text_property(name) or ""
        return {number: title for number, title in found.items() if "fluidwarp" in title}

    @cached_property
    def _x(self) -> Any:
        """A connection to the screen: a process for each look at it would cost more than what is looked at."""
        from Xlib import display  # which others than Linux need not have

        return display.Display(self.env["DISPLAY"])

    def scale(self, factor: float) -> None:
        """Tell programs that start from now on how much larger than usual they should draw."""
        from Xlib import Xatom

        resources = f"Xft.dpi:\t{96 * factor:g}\n".encode()
        self._x.screen().root.change_property(Xatom.RESOURCE_MANAGER, Xatom.STRING, 8, resources)
        self._x.sync()

    def dump(self) -> bytes:
        """The file in which the server keeps the screen, as it is now."""
        return (self.folder / "Xvfb_screen0").read_bytes()

    def seen(self, dump: bytes | None = None) -> np.ndarray:
        """The screen as it is now, or was in a `dump`, (h, w, 3) uint8."""
        data = self.dump() if dump is None else dump
        # The header of an X window dump: 25 numbers, then the window's name up to its own length, then the colours.
        head = np.frombuffer(data, ">u4", 25)
        start, width, height, row, colours = (int(head[at]) for at in (0, 4, 5, 12, 19))
        rows = np.frombuffer(data, np.uint8, row * height, start + 12 * colours).reshape(height, row)
        return rows[:, : 4 * width].reshape(height, width, 4)[..., 2::-1]

    @contextmanager
    def covered(self, left: int, top: int, right: int, bottom: int) -> Iterator[None]:
        """While the block runs, a magenta window without a frame lies over a part of the screen."""
        from Xlib import X

        size, root = (right - left, bottom - top), self._x.screen().root
        cover = root.create_window(
            left, top, *size, 0, X.CopyFromParent, override_redirect=True, background_pixel=0xFF00FF
        )
        cover.map()
        self._x.sync()
        try:
            self.until(lambda: bool((self.seen()[top:bottom, left:right] == (255, 0, 255)).all()), "the cover")
            yield
        finally:
            cover.destroy()
            self._x.sync()

    def title(self) -> str:
        return self.titles().get(self.window, "")

    def do(self, *words: str) -> str:
        return subprocess.run(["xdotool", *words], env=self.env, capture_output=True, text=True).stdout

    def drag(self, *points: tuple[int, int]) -> None:
        words = ["mousemove", *map(str, points[0]), "sleep", "0.1", "mousedown", "1", "sleep", "0.1"]
        for start, end in pairwise(points):
            for step in range(1, 11):
                x, y = (round(a + (b - a) * step / 10) for a, b in zip(start, end, strict=True))
                words += ["mousemove", str(x), str(y), "sleep", "0.03"]
        self.do(*words, "sleep", "0.1", "mouseup", "1", "sleep", "0.2")

    def key(self, chord: str) -> None:
        self.do("key", "--delay", "60", chord)
        time.sleep(0.3)

    def type(self, text: str) -> None:
        self.do("type", "--delay", "60", text)
        time.sleep(0.3)

    def until(self, condition: Callable[[], bool], what: str) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            if self.editor is not None and self.editor.poll() is not None:
                said = self.editor.stdout.read() if self.editor.stdout else ""
                raise AssertionError(f"the editor ended while waiting for {what}: {said}")
            assert time.monotonic() < deadline, f"waited in vain for {what}"
            time.sleep(0.1)

    def insist(self, doing: Callable[[], None], condition: Callable[[], bool], what: str) -> None:
        """Do something until it has worked, as a person would: a busy machine may miss a key between two frames."""
        for attempt in range(3):
            doing()
            deadline = time.monotonic() + PATIENCE / 3
            while time.monotonic() < deadline:
                if condition():
                    return
                time.sleep(0.1)
            self.key("Escape")
            time.sleep(attempt)
        self.until(condition, what)

    @property
    def is_asking(self) -> bool:
        """A dialog is to be seen: what lies below it, such as the tools at the left, is dim."""
        return 60 < self.seen()[60:700, :48].max() < 215

    def ask(self, chord: str) -> None:
        """Press the key of a dialog, and wait until that is to be seen."""
        self.insist(lambda: self.key(chord), lambda: self.is_asking, f"the dialog of {chord}")
        time.sleep(0.5)  # its size follows what is in it some frames later

    def save(self, path: Path) -> None:
        """Save what is open under a new name in the folder that is proposed."""

        def do() -> None:
            self.ask("ctrl+s")
            # The name is marked, and what is typed takes its place.
            self.key("ctrl+a")
            self.type(path.stem)
            self.key("Return")

        self.insist(do, path.exists, "the project to be saved")
        self.until(lambda: self.title() == f"{path.stem} - fluidwarp", "the title to say so")

    @contextmanager
    def busy(self) -> Iterator[None]:
        """While the block runs the editor gets a third of a processor, as on a machine that has much else to do."""
        assert self.editor is not None
        editor, ended = self.editor, threading.Event()
        clock = ~editor.pid << 3 | 2  # of its processor time, as clock_getcpuclockid(3) makes it

        def hold_up() -> None:
            left, since, spent = SLICE, time.monotonic(), time.clock_gettime(clock)
            while not ended.wait(SLICE) and editor.poll() is None:
                now, used = time.monotonic(), time.clock_gettime(clock)
                left = min(left + (now - since) / 3 - (used - spent), SLICE)
                since, spent = now, used
                editor.send_signal(signal.SIGCONT if left > 0 else signal.SIGSTOP)
            editor.send_signal(signal.SIGCONT)

        others = threading.Thread(target=hold_up)
        others.start()
        try:
            yield
        finally:
            ended.set()
            others.join()

    def leave(self) -> None:
        """Quit; again where something that had not ended, such as an export, was asked about first."""
        editor = self.editor
        assert editor is not None
        self.insist(lambda: self.key("ctrl+q"), lambda: editor.poll() is not None, "the editor to end")
        self.until_gone()

    def until_gone(self) -> None:
        """Wait until the editor has ended by itself, and well."""
        assert self.editor is not None
        assert self.editor.wait(PATIENCE) == 0, self.editor.stdout.read() if self.editor.stdout else ""

    def close(self) -> None:
        if self.editor is not None and self.editor.poll() is None:
            self.editor.kill()
            self.editor.wait()
        self._x.close()
        self.screen.terminate()
        self.screen.wait(10)
