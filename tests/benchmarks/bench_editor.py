"""What a frame of the editor costs while someone paints: python tests/benchmarks/bench_editor.py [--window]

A Push stroke of 60 moves over the sample picture with the default preset, 1280 x 800, one tick a frame, without a
window. First the frame as it is, waiting for the GPU at its end only; then its parts, waiting around each of them. J is
one five-point Jacobi pass on the simulation's grid in the same run. Shares and J hold when the machine's speed drifts,
milliseconds do not; processor time counts what all threads of this process have used, and not what others have.

With `--handles`, the last of so many handles is dragged in place of the stroke; the others have arrived and stay led.

With `--full`, what is to stay at 30 frames a second on two cores: a clip of 1280 x 720, a frozen place, a thick one, a
radial symmetry of 8, and every overlay.

With `--window`, the real one under Xvfb, dragged about by xdotool: from the start of the process to its first frame,
the load of ten seconds at rest, and the time between two frames while painting.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise, product
from math import cos, sin
from pathlib import Path

import imageio_ffmpeg
from bench_step import Jacobi
from rich.console import Console
from rich.table import Table

from app.ui.clock import Clock
from app.ui.events import LEFT, Button, Move, Wheel
from app.ui.screenshots import TICK, OffscreenEditor, line
from solver import Device

ROOT = Path(__file__).parent.parent.parent
MOVES = 60
REST = 10.0  # seconds
STAGES = ("brush", "advect", "diffuse", "project", "warp map")
OVERLAYS = ("1", "2", "3", "4", "5")  # their keys
MASKED = {"f": (0.2, 0.7), "v": (0.7, 0.7)}  # by the key of a tool, where it is used before painting
PARTS = ("simulate", "canvas", "panels", "interface")


class Waiting(Clock):
    """A clock that waits for the GPU around what it measures, and adds up."""

    def __init__(self, device: Device) -> None:
        super().__init__()
        self.device = device
        self.spent: dict[str, float] = defaultdict(float)

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        self.device.ctx.finish()
        start = time.perf_counter()
        yield
        self.device.ctx.finish()
        self.spent[name] += (time.perf_counter() - start) * 1e3


def clip(folder: Path) -> Path:
    """Ten seconds of 1280 x 720."""
    path = folder / "clip.mp4"
    source = ["-f", "lavfi", "-i", "testsrc2=size=1280x720:rate=30:duration=10", "-pix_fmt", "yuv420p"]
    subprocess.run([imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", *source, path], check=True)
    return path


def handles(count: int) -> list[tuple[int, int]]:
    """Places on the canvas, points of the window, for up to 16 handles but the one that is dragged."""
    places: list[tuple[int, int]] = [*product((270, 400, 530, 660), (150, 250, 350, 450))]
    return places[: max(count - 1, 0)]


def stroke(offscreen: OffscreenEditor, each: Callable[[Callable[[], None]], None]) -> None:
    """One stroke, each frame of it by `each`; then everything as before it."""
    editor, path = offscreen.editor, line((450.0, 380.0), (650.0, 310.0), -20.0)
    for move in range(MOVES + 1):
        events = [Move(*path(move / MOVES)), *([Button(LEFT, True)] if move == 0 else [])]
        each(lambda events=events: editor.frame(offscreen.target, offscreen.size, TICK, events, offscreen.density))
    offscreen.frame(Button(LEFT, False))
    editor.session.pause()
    editor.do("undo")
    for _ in range(3):
        offscreen.frame()


def frames(device: Device, cells: int, options: argparse.Namespace, table: Table) -> None:
    """The rows of one grid."""
    offscreen, rounds = OffscreenEditor(device, grid=cells, file=options.open), options.rounds
    if options.full:
        for tool, (x, y) in MASKED.items():
            offscreen.key(tool)
            offscreen.stroke(line((x, y), (x + 0.05, y)), 8)
        offscreen.key("p")
    for key in options.keys:
        offscreen.key(key)
    for _ in range(options.zoom):
        offscreen.frame(Move(550.0, 345.0), Wheel(0.0, 1.0))
    if options.sectors:
        offscreen.editor.state.symmetry, offscreen.editor.state.sectors = "radial", options.sectors
    if options.handles:
        offscreen.key("g")
    for x, y in handles(options.handles):
        offscreen.frame(Move(x, y))
        offscreen.frame(Button(LEFT, True))
        offscreen.frame(Move(x + 14.0, y + 8.0))
        offscreen.frame(Button(LEFT, False))
        offscreen.editor.session.settle()
    jacobi = Jacobi(device, offscreen.editor.session.replay.grid, pairs=1)
    walls: list[float] = []
    works: list[float] = []
    units: list[float] = []

    def whole(frame: Callable[[], None]) -> None:
        device.ctx.finish()
        wall, work = time.perf_counter(), time.process_time()
        frame()
        device.ctx.finish()
        walls.append((time.perf_counter() - wall) * 1e3)
        works.append((time.process_time() - work) * 1e3)
        start = time.perf_counter()
        jacobi.ten()
        device.ctx.finish()
        units.append((time.perf_counter() - start) * 1e2)

    stroke(offscreen, lambda frame: frame())
    for _ in range(rounds):
        stroke(offscreen, whole)
    wall, unit = statistics.median(walls), statistics.median(units)
    late = sorted(walls)[int(0.95 * len(walls))]
    work = statistics.median(works)
    table.add_row(f"{cells}", "frame, median", f"{wall:.1f}", f"{wall / unit:.0f}", "", f"{work:.1f} of processor time")
    table.add_row("", "frame, 95 of 100", f"{late:.1f}", f"{late / unit:.0f}")

    clock = offscreen.editor.clock = Waiting(device)
    device.timings.take()
    device.timings.enabled = True
    count = 0

    def part(frame: Callable[[], None]) -> None:
        nonlocal count
        frame()
        count += 1

    spent: dict[str, float] = defaultdict(float)
    passes: dict[str, float] = defaultdict(float)
    for _ in range(rounds):
        clock.spent.clear()
        device.timings.take()
        session = offscreen.editor.session

        def last(frame: Callable[[], None]) -> None:
            part(frame)
            if count % (MOVES + 1) == 0:
                for name, milliseconds in (clock.spent | device.timings.milliseconds).items():
                    spent[name] += milliseconds
                for name, number in device.timings.passes.items():
                    passes[name] += number

        stroke(offscreen, last)
        assert not session.is_painting
    device.timings.enabled = False
    spent["keeping, recording"] = spent["simulate"] - sum(spent[name] for name in STAGES)
    whole_frame = spent["frame"]
    spent["the rest"] = whole_frame - sum(spent[name] for name in PARTS)
    for name in ("simulate", *STAGES, "keeping, recording", "canvas", "panels", "interface", "the rest"):
        mean = spent[name] / count
        inner = name in (*STAGES, "keeping, recording")
        number = f"{passes[name] / count:.0f} passes" if name in STAGES else ""
        row = f"{'    ' if inner else '  '}{name}", f"{mean:.2f}", f"{mean / unit:.1f}"
        table.add_row("", *row, f"{spent[name] / whole_frame:.0%}", number)
    jacobi.release()
    offscreen.close()


# The real window ------------------------------------------------------------------------------------------------------

# Runs in the editor's process: tells when each frame was shown, and the grid then.
CHILD = """
import os, sys, time, glfw
from app.cli import main
from app.ui.editor import Editor
editors = []
made, shown = Editor.__init__, glfw.swap_buffers
def make(editor, *args, **more):
    editors.append(editor)
    made(editor, *args, **more)
    if sectors := int(os.environ["SECTORS"]):
        editor.state.symmetry, editor.state.sectors = "radial", sectors
def swap(window):
    shown(window)
    print(f"{time.time():.6f} {editors[0].session.recipe.fluid.grid} {editors[0].session.replay.steps}", flush=True)
Editor.__init__, glfw.swap_buffers = make, swap
sys.argv = ["fluidwarp", "edit", *sys.argv[1:]]
main()
"""


def drag(env: dict[str, str], seconds: float) -> None:
    """Drag about on the canvas in a circle."""
    words = ["mousemove", "560", "300", "mousedown", "1"]
    steps = int(seconds / 0.01)
    for step in range(steps):
        turn = step * 0.02
        words += ["mousemove", str(round(460 + 100 * cos(turn))), str(round(300 + 100 * sin(turn))), "sleep", "0.01"]
    subprocess.run(["xdotool", *words, "mouseup", "1"], env=env, check=True)


def processor_time(pid: int) -> float:
    """Seconds that a process has used so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def window(console: Console, options: argparse.Namespace) -> None:
    """The real window's figures; with a file, keys, turns of the wheel, sectors and a count of handles, if any."""
    rounds, file, keys, zoom, count = options.rounds, options.open, options.keys, options.zoom, options.handles
    screen = subprocess.Popen(
        ["Xvfb", "-displayfd", "1", "-screen", "0", "1280x800x24", "-noreset", "-nolisten", "tcp"],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    assert screen.stdout is not None
    display = f":{int(screen.stdout.readline())}"
    try:
        with tempfile.TemporaryDirectory() as folder:
            env = {**os.environ, "DISPLAY": display, "XDG_CONFIG_HOME": folder, "HOME": folder}
            env.pop("WAYLAND_DISPLAY", None)
            env["SECTORS"] = str(options.sectors)
            command = [sys.executable, "-c", CHILD, *([str(file.resolve())] if file else [])]
            starts = []
            for number in range(rounds):
                begun = time.time()
                log = Path(folder) / "frames"
                with log.open("w") as out:
                    child = subprocess.Popen(command, env=env, cwd=ROOT, stdout=out)
                while not (shown := log.read_text().split()):
                    assert child.poll() is None, "the editor ended"
                    time.sleep(0.02)
                starts.append(float(shown[0]) - begun)
                if number < rounds - 1:
                    child.kill()
                    child.wait()
            console.print("from the start of the process to its first frame:", *(f"{start:.2f} s" for start in starts))
            time.sleep(8)  # until it has measured the machine and is at rest
            before = processor_time(child.pid)
            time.sleep(REST)
            console.print(f"at rest: {(processor_time(child.pid) - before) / REST:.2%} of a core")
            prepare = [word for key in keys for word in ("key", "--delay", "200", key, "sleep", "0.5")]
            prepare += ["mousemove", "460", "300"]
            prepare += [word for _ in range(zoom) for word in ("click", "4", "sleep", "0.3")]
            prepare += ["key", "--delay", "200", "g", "sleep", "0.5"] if count else []
            for x, y in handles(count):
                there = "mousemove", f"{x + 14}", f"{y + 8}"
                prepare += ["mousemove", f"{x}", f"{y}", "mousedown", "1", "sleep", "0.2", *there, "sleep", "0.2"]
                prepare += ["mouseup", "1", "sleep", "2"]
            for tool, (x, y) in MASKED.items() if options.full else ():
                prepare += [
                    "key",
                    "--delay",
                    "200",
                    tool,
                    "sleep",
                    "0.5",
                    "mousemove",
                    f"{300 + 400 * x:.0f}",
                    f"{200 + 300 * y:.0f}",
                ]
                prepare += [
                    "mousedown",
                    "1",
                    "sleep",
                    "0.3",
                    "mousemove_relative",
                    "20",
                    "0",
                    "sleep",
                    "0.3",
                    "mouseup",
                    "1",
                ]
                prepare += ["sleep", "1", "key", "--delay", "200", "p", "sleep", "0.5"]
            subprocess.run(["xdotool", *prepare], env=env, check=True)
            time.sleep(1)
            drag(env, 3.0)  # whatever has to be compiled
            time.sleep(3)
            start, used = time.time(), processor_time(child.pid)
            drag(env, 6.0)
            end = time.time()
            lines = [line.split() for line in log.read_text().splitlines()]
            times = [float(moment) for moment, _, _ in lines]
            times = [moment for moment in times if start + 0.3 < moment < end - 0.1]
            gaps = sorted((b - a) * 1e3 for a, b in pairwise(times))
            steps = [int(count) for moment, _, count in lines if times[0] <= float(moment) <= times[-1]]
            shown_in_all = sum(start < float(moment) < end for moment, _, _ in lines)
            used = processor_time(child.pid) - used
            console.print(
                f"painting: {len(gaps) / (times[-1] - times[0]):.1f} frames a second; between two frames "
                f"{statistics.median(gaps):.1f} ms, 95 of 100 within {gaps[int(0.95 * len(gaps))]:.1f} ms; "
                f"{used / (end - start):.0%} of a core, {used * 1e3 / shown_in_all:.1f} ms of it a frame; "
                f"grid {lines[-1][1]}, {(steps[-1] - steps[0]) / len(gaps):.2f} steps a frame"
            )
            child.kill()
            child.wait()
    finally:
        screen.terminate()
        screen.wait()


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--grids", type=int, nargs="*", default=[192, 256])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--window", action="store_true", help="the real window, under Xvfb")
    parser.add_argument("--open", type=Path, help="a picture, recipe or project, instead of the sample picture")
    parser.add_argument("--keys", nargs="*", default=[], help="pressed before painting, as xdotool calls them")
    parser.add_argument("--zoom", type=int, default=0, help="turns of the wheel before painting")
    parser.add_argument("--handles", type=int, default=0, help="to 16; the last is dragged instead of painting")
    parser.add_argument("--sectors", type=int, default=0, help="of radial symmetry, 2 to 16")
    parser.add_argument("--full", action="store_true", help="a clip, masks, symmetry and all overlays")
    args = parser.parse_args()
    console = Console(width=150)
    with tempfile.TemporaryDirectory() as folder:
        if args.full:
            args.open, args.sectors, args.keys = clip(Path(folder)), 8, [*OVERLAYS, *args.keys]
        measure(console, args)


def measure(console: Console, args: argparse.Namespace) -> None:
    """Print what was asked for."""
    if args.window:
        window(console, args)
        return
    with Device.headless() as device:
        table = Table(title=f"{device.limits.renderer}, {os.cpu_count()} cores")
        for head in ("grid", "part", "ms", "J", "share", ""):
            table.add_column(head, justify="right" if head in ("ms", "J", "share") else "left")
        for cells in args.grids:
            frames(device, cells, args, table)
        console.print(table)


if __name__ == "__main__":
    main()
