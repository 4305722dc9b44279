"""Does anything, in the real window under Xvfb, and looks whether anything is lost.

    python tests/wandering.py [--actions 2000] [--seed 0] [--size 640x480] [--busy] [--folder DIR]

Strokes, keys, tools, undo, sliders, zoom, masks, handles, bars, symmetry, dialogs, saving, reopening. Events are sent
at once, with no rest between the samples of a stroke but what chance gives. Held together are: every place that was
sent of a stroke and the samples of the recipe, whose ticks are those at which they were heard, or as soon as the brush
could be there, and go no faster than the clock; what the editor takes for held of pointer and keyboard, and what is,
which is nothing; the recipe in the saved project and in the editor; and at the end the bytes of an export and of
`fluidwarp render`. Ends with 0 if all was as it should be; what was not stands in the output, after the actions before.
"""

from __future__ import annotations

import argparse
import faulthandler
import filecmp
import hashlib
import json
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter, deque
from contextlib import nullcontext, suppress
from math import dist
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
sys.path[:0] = [path for path in (str(ROOT), str(ROOT / "tests")) if path not in sys.path]

PATIENCE = 300.0
DRAWN = 0.004  # longer sides between the places of a curve
SITTING = 100  # actions with one work, until it is saved, the editor left, and the work opened again and exported
PAINTS = {
    "p": "push",
    "c": "curve",
    "t": "twirl",
    "b": "bloat",
    "v": "thicken",
    "f": "freeze",
    "s": "smooth",
    "r": "restore",
}
KEYS = ("[", "]", "{", "}", ";", "'", ".", ",", "home", "end", "space", "y", "l", "u", "x", "left", "right", "delete",
        "escape", "1", "2", "3", "4", "5", "0", "=", "-", "Tab", "ctrl+l", "ctrl+i", "ctrl+shift+i", "ctrl+shift+f",
        "ctrl+d", "ctrl+r", "ctrl+1", "shift+m", "\\", "ctrl+a", "Return", "shift+Return")  # fmt: skip


PARTS = ("bar", "inspector", "timebar", "lanes", "strip")


# -- the editor, which tells what it does -----------------------------------------------------------------------------


def digest(recipe: Any) -> str:
    """What tells strokes and masks from others."""
    return hashlib.sha256(repr((recipe.stroke, recipe.mask, recipe.handle, recipe.pin)).encode()).hexdigest()


def tell() -> None:
    """Let the editor of this process print what it is about, whenever that is another than before."""
    from imgui_bundle import imgui

    from app.model.strokes import BrushPath
    from app.model.tools import farthest
    from app.ui.editor import Editor
    from app.ui.events import Mods
    from app.ui.pointer import SPLIT_REACH
    from app.ui.viewport import Rect
    from app.work.gesture import kept_near
    from app.work.session import Session

    frame, press, move, release, last = Editor.frame, Session.press, Session.move, Session.release, [""]
    editors: list[Editor] = []
    begun = [0.0, 0.0]
    heard: list[tuple[float, ...]] = []  # of the gesture: when, the clock of the frames, tick, x, y
    clock = 0.0
    told: list[Any] = [None, ""]  # a recipe, and what it comes to

    def say(**what: Any) -> None:
        print(json.dumps(what), flush=True)

    def frame_and_tell(self: Editor, *given: Any, **named: Any) -> None:
        editors[:] = [self]
        frame(self, *given, **named)
        nonlocal clock
        clock += given[2] if len(given) > 2 else named["dt"]
        if self.session.document.recipe is not told[0]:
            told[:] = self.session.document.recipe, digest(self.session.document.recipe)
        pointer, view, io = self.pointer, self.workspace.view, imgui.get_io()
        rects = [view.rect, view.canvas, *self.ui.covers]
        if (split := self.state.split) is not None:  # its line is taken hold of, and no stroke begins there
            reach = self.ui.px(SPLIT_REACH)
            x, _ = view.to_screen(split, 0)
            rects.append(Rect(x - reach, view.canvas.y, 2 * reach, view.canvas.height))
        now = json.dumps({
            "at": (pointer.x, pointer.y),
            "tool": self.state.tool_name,
            "string": self.state.stabiliser,
            "rects": [(rect.x, rect.y, rect.width, rect.height) for rect in rects],
            "held": [name for name, is_so in {
                "drag": pointer.drag, "space": pointer.space, "before": self.state.before,
                "painting": self.session.is_painting, f"{pointer.mods}": pointer.mods != Mods(),
                "imgui": any(io.mouse_down) or io.key_ctrl or io.key_shift or io.key_alt,
                "behind": self.backend.is_behind,
            }.items() if is_so],
            "dialogs": [type(dialog).__name__ for dialog in self.dialogs.shown],
            "popup": self.ui.has_popup,
            "typing": self.backend.is_typing,
            "busy": any((
                self.files.is_loading, self.exports.is_running, self.session.is_behind, self.recovery.is_busy,
            )),
            "moving": self.session.is_moving,
            "dirty": self.workspace.is_dirty,
            "recipe": told[1],
            "inspector": self.state.inspector,
            "messages": [message.text for message in self.messages.shown],
            "layout": {name: (rect.x, rect.y, rect.width, rect.height) for name in PARTS
                       if (rect := getattr(self.layout, name)) is not None},
        })  # fmt: skip
        if now != last[0]:
            last[0] = now
            print(now, flush=True)

    def hear(self: Session, x: float, y: float) -> None:
        if (gesture := self._gesture) is not None:
            heard.append((time.monotonic(), clock, gesture.pen, *kept_near(x, y)))

    def move_and_tell(self: Session, x: float, y: float, *more: Any) -> None:
        move(self, x, y, *more)
        hear(self, x, y)

    def press_and_tell(self: Session, tool: Any, given: Any, x: float, y: float, *more: Any) -> None:
        press(self, tool, given, x, y, *more)
        begun[:] = x, y
        heard.clear()
        hear(self, x, y)
        rect = editors[0].workspace.view.rect
        say(press=tool.name, rect=(rect.x, rect.y, rect.width, rect.height))

    def release_and_tell(self: Session) -> None:
        before, was = self.document.recipe, self.is_painting
        release(self)
        if not was:
            return
        after = self.document.recipe
        new = [one for one in (*after.stroke, *after.mask) if one not in before.stroke and one not in before.mask]
        new = [one for one in new if isinstance(one, BrushPath)]
        # Others are new because they were cut off at this moment.
        new = [one for one in new if any(dist(end[1:3], begun) < 1e-4 for end in (one.samples[0], one.samples[-1]))]
        made = [[(*sample[1:3], sample[0]) for sample in one.samples] for one in new]
        reach = [farthest(one, self.dt) for one in new]
        say(made=made, reach=reach, heard=heard, dt=self.dt, extent=self.extent)

    for of, name, telling in (
        (Editor, "frame", frame_and_tell),
        (Session, "press", press_and_tell),
        (Session, "move", move_and_tell),
        (Session, "release", release_and_tell),
    ):
        setattr(of, name, telling)


def edit(file: Path) -> None:
    from app.ui.window import run

    faulthandler.register(signal.SIGUSR1)
    tell()
    run(file)


# -- the hand --------------------------------------------------------------------------------------------------------


class Hand:
    """A pointer and a keyboard on a screen, an event at a time."""

    def __init__(self, display: str) -> None:
        from Xlib import XK, X
        from Xlib import display as displays
        from Xlib.ext import xtest

        self.screen, self._x, self._fake = displays.Display(display), X, xtest.fake_input
        self._named = {"ctrl": "Control_L", "shift": "Shift_L", "alt": "Alt_L", "[": "bracketleft", "]": "bracketright",
                       ";": "semicolon", "'": "apostrophe", ".": "period", ",": "comma",
                       "=": "equal", "-": "minus", "\\": "backslash", "home": "Home", "end": "End", "left": "Left",
                       "right": "Right", "delete": "Delete", "escape": "Escape"}  # fmt: skip
        self.chords = deque[str](maxlen=12)
        self._sym = XK.string_to_keysym

    def _send(self, kind: int, detail: int = 0, **more: int) -> None:
        self._fake(self.screen, kind, detail, **more)
        self.screen.sync()

    def move(self, x: int, y: int) -> None:
        self._send(self._x.MotionNotify, x=x, y=y)

    def button(self, number: int, down: bool) -> None:
        self._send(self._x.ButtonPress if down else self._x.ButtonRelease, number)

    def one_key(self, name: str, down: bool) -> None:
        code = self.screen.keysym_to_keycode(self._sym(self._named.get(name, name)))
        self._send(self._x.KeyPress if down else self._x.KeyRelease, code)

    def key(self, chord: str) -> None:
        self.chords.append(chord)
        names = chord.split("+")
        if chord in ("{", "}"):
            names = ["shift", {"{": "[", "}": "]"}[chord]]
        for name in names:
            self.one_key(name, True)
        for name in reversed(names):
            self.one_key(name, False)
        time.sleep(0.004)  # GLFW takes two presses of a key within a millisecond for one


class Fault(Exception):
    """Something is not as it should be."""


class Sitting:
    """An editor in its window with work opened, and the hand that uses it.

    Args:
        desk: its screen.
        project: what is opened.
        dice: that choose.
    """

    def __init__(self, desk: Any, project: Path, dice: random.Random) -> None:
        self.desk, self.project, self.dice = desk, project, dice
        self.hand = Hand(desk.env["DISPLAY"])
        self.now: dict[str, Any] = {}
        self.told: deque[dict[str, Any]] = deque()
        self.sent_at = deque[list[float]](maxlen=3)  # when the places of the last strokes were sent
        self.samples, self.late = 0, 0.0  # held together, and seconds that one was heard after it was sent at most
        self._corner = 0
        self._log = (desk.folder / "stderr.txt").open("w+")
        command = [sys.executable, str(Path(__file__)), "--edit", str(project)]
        desk.editor = self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=self._log, text=True, cwd=desk.folder, env=desk.env
        )
        threading.Thread(target=self._read, daemon=True).start()
        self.until(
            lambda: bool(self.now) and not self.now["busy"] and desk.is_shown and self._is_open(), "the work to be open"
        )

    def _is_open(self) -> bool:
        self.desk.window = next(iter(self.desk.titles()))
        return self.project.stem in self.desk.title()

    def _read(self) -> None:
        for line in self.process.stdout or ():
            with suppress(ValueError):
                what = json.loads(line)
                if "at" in what:
                    self.now = what
                else:
                    self.told.append(what)

    def stderr(self) -> str:
        self._log.seek(0)
        return self._log.read()

    def until(self, condition: Any, what: str) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            if self.process.poll() is not None:
                raise Fault(
                    f"the editor ended with {self.process.returncode} while waiting for {what}: {self.stderr()}"
                )
            if time.monotonic() > deadline:
                self.process.send_signal(signal.SIGUSR1)  # where it is, on stderr
                time.sleep(1.0)
                raise Fault(f"waited in vain for {what}; {self.now}; {self.stderr()}")
            time.sleep(0.01)

    def meet(self) -> None:
        """Wait until the editor has taken all that was sent; nothing is held then."""
        x, y, _, height = self.now["rects"][1]
        self._corner = (self._corner + 1) % 40
        place = int(x + 2 + self._corner), int(y + height - 3)
        self.hand.move(*place)
        self.until(lambda: tuple(self.now["at"]) == place, f"the pointer to be at {place}")
        try:
            self.until(lambda: not self.now["held"], "everything to be let go of")
        except Fault:
            down = [code for code in range(256) if self.hand.screen.query_keymap()[code // 8] >> code % 8 & 1]
            raise Fault(f"stuck: {self.now['held']}, down {down}") from None
        if self.stderr():
            raise Fault(f"on stderr: {self.stderr()}")

    def quiet(self) -> None:
        """Close what is open over the canvas."""
        for _ in range(8):
            self.meet()
            if not (self.now["dialogs"] or self.now["popup"] or self.now["typing"]):
                return
            if "Recovery" in str(self.now["dialogs"]):
                raise Fault("work is offered that was left well")
            self.hand.key("escape")
            time.sleep(0.15)
        raise Fault(f"does not close: {self.now['dialogs']}, popup {self.now['popup']}, typing {self.now['typing']}")

    # -- what is done --------------------------------------------------------------------------------------------------

    def place(self) -> tuple[int, int] | None:
        """A point of the screen on the picture, with nothing over it."""
        (left, top, across, down), canvas, *covers = self.now["rects"]
        low = max(left, canvas[0]) + 8, max(top, canvas[1]) + 70
        high = min(left + across, canvas[0] + canvas[2]) - 8, min(top + down, canvas[1] + canvas[3]) - 60
        if high[0] - low[0] < 20 or high[1] - low[1] < 20:
            return None
        for _ in range(20):
            x, y = (round(self.dice.uniform(a, b)) for a, b in zip(low, high, strict=True))
            if not any(a <= x < a + w and b <= y < b + h for a, b, w, h in covers):
                return x, y
        return None

    def anywhere(self, part: str) -> tuple[int, int]:
        x, y, width, height = self.now["layout"].get(part, self.now["layout"]["timebar"])
        left = 120 if part == "bar" else 0  # without the menu, and without the button that exports
        right = 330 if part == "bar" else 0
        return round(self.dice.uniform(x + left, x + width - right - 1)), round(
            self.dice.uniform(y + 1, y + height - 2)
        )

    def rest(self) -> None:
        if self.dice.random() < 0.4:
            time.sleep(self.dice.choice((0.002, 0.01, 0.03)))

    def stroke(self) -> list[tuple[int, int]] | None:
        """A stroke from somewhere to somewhere, at once; the places that were sent."""
        if (start := self.place()) is None:
            return None
        canvas, sent = self.now["rects"][1], [start]
        self.sent_at.append([time.monotonic()])
        self.hand.move(*start)
        self.hand.button(1, True)
        step = self.dice.choice((2, 6, 20))
        for number in range(self.dice.randint(2, 25)):
            far = step if number else 24  # at first so far that something comes of a curve, too
            x, y = (p + self.dice.choice((-1, 1)) * self.dice.randint(far // 2, far) for p in sent[-1])
            x = min(max(x, int(canvas[0]) + 1), int(canvas[0] + canvas[2]) - 1)
            y = min(max(y, int(canvas[1]) + 1), int(canvas[1] + canvas[3]) - 1)
            if (x, y) != sent[-1]:
                sent.append((x, y))
                self.sent_at[-1].append(time.monotonic())
                self.hand.move(x, y)
                self.rest()
        self.hand.button(1, False)
        return sent

    def paint(self) -> None:
        """Some strokes with one tool, one right after the other; each of their places is held to the recipe."""
        key = self.dice.choice(list(PAINTS))
        self.hand.key(key)
        self.meet()
        if self.now["tool"] != PAINTS[key] or self.now["string"]:
            return
        alt = self.dice.random() < 0.2
        self.told.clear()
        if alt:
            self.hand.one_key("alt", True)
        ways = [(way, self.sent_at[-1]) for _ in range(self.dice.randint(1, 3)) if (way := self.stroke())]
        sent = [(way, when) for way, when in ways if len(set(way)) > 1]
        if alt:
            self.hand.one_key("alt", False)
        self.meet()
        presses = [one["rect"] for one in self.told if "press" in one]
        releases = [told for told in self.told if "made" in told]
        made = [(*one, told) for told in releases for one in zip(told["made"], told["reach"], strict=True)]
        if len(presses) != len(sent) or len(made) != len(sent):
            raise Fault(
                f"{len(sent)} strokes of {PAINTS[key]} sent, {len(presses)} begun, {len(made)} made; {self.now}"
            )
        for (way, when), rect, (samples, reach, told) in zip(sent, presses, made, strict=True):
            found = self.compare(way, rect, samples, PAINTS[key] == "curve")
            if PAINTS[key] != "curve":
                self.compare_times(when, samples[0][2], [samples[at] for at in found], reach, told)

    def compare_times(
        self, when: list[float], first: float, samples: list[list[float]], reach: float, told: dict[str, Any]
    ) -> None:
        """Each has the tick in which it was heard, or the one in which the brush, at its speed, could be there.

        Ticks in turn go no faster than the clock; on a machine that is too slow they may go slower.
        """
        heard, dt, at, arrives = told["heard"], told["dt"], 0, 0.0
        (_, began, pen, *_), before = heard[0], samples[0]
        for sent, sample in zip(when, samples, strict=True):
            while at < len(heard) and max(abs(a - b) for a, b in zip(heard[at][3:], sample[:2], strict=True)) > 1.1e-5:
                at += 1
            if at == len(heard):
                raise Fault(f"{sample} is recorded and was not heard: {told}")
            moment, clock, tick, *_ = heard[at]
            far = dist(
                *([x * side for x, side in zip(one[:2], told["extent"], strict=True)] for one in (before, sample))
            )
            # Until the tick before the one in which it was heard the brush stood where it was.
            leaves = max(arrives, tick - pen - 1)
            arrives, before = max(tick - pen, leaves + far / reach), sample
            if not tick - pen <= sample[2] - first <= arrives + 1:
                raise Fault(f"{sample} is not of tick {first + arrives:.2f}: {told}, {samples}")
            if moment < sent or (tick - pen) * dt > clock - began + 2.7 * dt:
                raise Fault(
                    f"{sample} was heard at {moment}, {clock - began} s after the press, sent at {sent}: {told}"
                )
            self.late = max(self.late, moment - sent)

    def compare(
        self, way: list[tuple[int, int]], rect: list[float], samples: list[list[float]], is_curve: bool
    ) -> list[int]:
        """Every place is a sample, in their order; of a curve, which may be reversed, there is one near each.

        The numbers of the samples that they are.
        """
        left, top, width, height = rect
        wanted = [(min(max((x - left) / width, -0.5), 1.5), min(max((y - top) / height, -0.5), 1.5)) for x, y in way]
        at, found = 0, list[int]()
        for number, place in enumerate(wanted):
            if is_curve:
                at = 0
            near = 1.5 * DRAWN if is_curve else 1.1e-5
            while at < len(samples) and max(abs(a - b) for a, b in zip(samples[at], place, strict=False)) > near:
                at += 1
            if at == len(samples):
                raise Fault(f"sample {number} of {len(wanted)} is lost: {place} of {wanted}, recorded {samples}")
            found.append(at)
        self.samples += len(way)
        return found

    def disturb(self) -> None:
        """Keys and the wheel during a stroke."""
        if (start := self.place()) is None:
            return
        self.hand.move(*start)
        button = self.dice.choice((1, 1, 1, 2, 3))
        self.hand.button(button, True)
        for _ in range(self.dice.randint(1, 4)):
            self.hand.move(*(p + self.dice.randint(-9, 9) for p in start))
            match self.dice.choice(("key", "key", "wheel", "shift", "rest")):
                case "key":
                    self.hand.key(self.dice.choice((*KEYS, *PAINTS, "g", "ctrl+z", "ctrl+shift+z")))
                case "wheel":
                    wheel = self.dice.choice((4, 5))
                    self.hand.button(wheel, True)
                    self.hand.button(wheel, False)
                case "shift":
                    self.hand.one_key("shift", True)
                    self.hand.move(*(p + self.dice.randint(-9, 9) for p in start))
                    self.hand.one_key("shift", False)
                case _:
                    self.rest()
        self.hand.button(button, False)

    def keys(self) -> None:
        for _ in range(self.dice.randint(1, 4)):
            self.hand.key(self.dice.choice(KEYS))
            self.rest()

    def tool(self) -> None:
        self.hand.key(self.dice.choice((*PAINTS, "g", "m", "h", "z", "shift+f", "shift+b")))

    def undo(self) -> None:
        for _ in range(self.dice.randint(1, 5)):
            self.hand.key(self.dice.choice(("ctrl+z", "ctrl+z", "ctrl+shift+z", "ctrl+y")))
            self.rest()

    def drag(self) -> None:
        """From anywhere in a part of the window to anywhere in it: sliders, bars, the playhead; or a click."""
        part = self.dice.choice(("bar", "inspector", "inspector", "timebar", "lanes", "strip"))
        x, y = self.anywhere(part)
        self.hand.move(x, y)
        self.rest()
        self.hand.button(1, True)
        if self.dice.random() < 0.6:
            for _ in range(self.dice.randint(1, 6)):
                x += self.dice.randint(-15, 15)
                self.hand.move(max(x, 0), y + self.dice.randint(-1, 1))
                self.rest()
        self.hand.button(1, False)

    def zoom(self) -> None:
        if (start := self.place()) is None:
            self.hand.key("0")
            return
        self.hand.move(*start)
        wheel = self.dice.choice((4, 5))
        for _ in range(self.dice.randint(1, 4)):
            self.hand.button(wheel, True)
            self.hand.button(wheel, False)
        if self.dice.random() < 0.3:
            self.hand.one_key("space", True)
            self.hand.button(1, True)
            self.hand.move(start[0] + self.dice.randint(-40, 40), start[1] + self.dice.randint(-40, 40))
            self.hand.button(1, False)
            self.hand.one_key("space", False)
        if self.dice.random() < 0.4:
            self.hand.key("0")

    def select(self) -> None:
        """Select something and fill it into a mask, or not."""
        self.hand.key("m")
        for _ in range(self.dice.randint(0, 2)):
            self.hand.key("shift+m")
        self.stroke()
        self.hand.key(self.dice.choice(("Return", "shift+Return", "escape", "i", "ctrl+shift+i")))

    def handle(self) -> None:
        """Place a handle or a pin; delete it, turn it, or leave it."""
        self.hand.key("g")
        self.stroke()
        self.hand.key(self.dice.choice(("delete", "escape", "p", "ctrl+z", "ctrl+z")))

    def dialog(self) -> None:
        """Open one, and close it."""
        self.hand.key(self.dice.choice(("ctrl+e", "F1", "ctrl+comma", "ctrl+o", "ctrl+shift+s", "ctrl+shift+o")))
        self.rest()
        if self.dice.random() < 0.5:
            self.hand.key(self.dice.choice(("Tab", "left", "1")))

    def pause(self) -> None:
        time.sleep(self.dice.uniform(0, 0.6))

    def save(self) -> None:
        """Save under the name that it has; the file has what the editor has."""
        from app.media.project import load

        self.hand.key("ctrl+s")
        self.meet()
        self.until(lambda: not self.now["dirty"] and not self.now["busy"], "the work to be saved")
        if digest(load(self.project).recipe) != self.now["recipe"]:
            raise Fault("what was saved is not what the editor has")

    def act(self, log: deque[str]) -> str:
        """Do one of these, and see that all is let go of; its name."""
        doing = self.dice.choices(
            (self.paint, self.disturb, self.keys, self.tool, self.undo, self.drag, self.zoom, self.select, self.handle,
             self.dialog, self.pause, self.save),
            (30, 6, 10, 6, 10, 14, 8, 6, 5, 4, 3, 3),
        )[0]  # fmt: skip
        log.append(doing.__name__)
        self.quiet()
        doing()
        self.meet()
        return doing.__name__

    def leave(self) -> None:
        """Save, and close the window."""
        self.quiet()
        self.save()
        self.quiet()
        self.hand.key("ctrl+q")
        if self.process.wait(PATIENCE) or self.stderr():
            raise Fault(f"left with {self.process.returncode}: {self.stderr()}")

    def export(self) -> None:
        """Export as it is proposed; the file has the bytes that the command line makes of the project."""
        self.quiet()
        self.hand.key("ctrl+e")
        self.until(lambda: bool(self.now["dialogs"]), "the dialog that exports")
        time.sleep(0.5)
        self.hand.key("Return")
        made, again = self.project.with_name(f"{self.project.stem} warped.png"), self.desk.folder / "again.png"
        made.unlink(missing_ok=True)
        self.until(lambda: made.exists() and not self.now["busy"], "the export")
        render = [sys.executable, "-m", "app", "render", str(self.project), "-o", str(again)]
        ended = subprocess.run(render, cwd=ROOT, capture_output=True, text=True)
        if ended.returncode or not filecmp.cmp(made, again, shallow=False):
            raise Fault(f"the window's export has other bytes than the command line's: {ended.stderr}")


def wander(folder: Path, actions: int, seed: int, size: tuple[int, int], is_busy: bool) -> bool:
    """Do so many actions; True if nothing was lost."""
    from app.media.project import save
    from support.desk import Desk
    from support.editing import small_project

    folder.mkdir(parents=True, exist_ok=True)
    dice, counts, log, samples = random.Random(seed), Counter[str](), deque[str](maxlen=12), 0
    late = 0.0
    project, made = folder / "work.fluidwarp", small_project(folder)
    sitting: Sitting | None = None
    desk, started = Desk(folder, threads=True), time.monotonic()
    try:
        while sum(counts.values()) < actions:
            save(made, project)
            sitting = Sitting(desk, project, dice)
            with desk.busy() if is_busy else nullcontext():
                for _ in range(min(SITTING, actions - sum(counts.values()))):
                    name = sitting.act(log)
                    counts[name] += 1
            sitting.leave()
            samples, late = samples + sitting.samples, max(late, sitting.late)
            sitting = Sitting(desk, project, dice)
            sitting.export()
            sitting.leave()
            took = time.monotonic() - started
            done = f"{sum(counts.values())} actions, {samples} samples, heard {late:.2f} s after they were sent at most"
            print(f"seed {seed}: {done}, {took:.0f} s", flush=True)
    except Fault as fault:
        chords = list(sitting.hand.chords) if sitting else []
        print(f"seed {seed}, action {sum(counts.values())}, {list(log)}, {chords}: {fault}", flush=True)
        return False
    finally:
        desk.close()
    print(dict(counts))
    return True


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--actions", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size", default="1280x800")
    parser.add_argument("--busy", action="store_true")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--edit", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.edit is not None:
        edit(given.edit)
        return 0
    with tempfile.TemporaryDirectory() if given.folder is None else nullcontext(given.folder) as folder:
        width, height = map(int, given.size.split("x"))
        return 0 if wander(Path(folder), given.actions, given.seed, (width, height), given.busy) else 1


if __name__ == "__main__":
    sys.exit(main())
