"""Damaged input for every reader, by the thousand: does any crash, hang or grow?

    python tests/fuzz.py [--reader png ...] [--inputs 1000] [--seed 0] [--findings DIR]

A reader may read what it is given or refuse it by a `UserError` of at most two lines. Anything else is a finding:
another exception, a process that ends, more than `LONGEST` seconds, more than `MOST_MEMORY` bytes. The input of each is
kept in DIR and named in the last lines; ends with 0 if there is none. Every input is a whole file, as fluidwarp itself
writes it, with bytes or words changed, lost, doubled or put in from another; the same seed gives the same ones.
`guided.py` lets coverage choose among such inputs.
"""

from __future__ import annotations

import argparse
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import closing, suppress
from itertools import islice
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path[:0] = [path for path in (str(ROOT), str(ROOT / "tests")) if path not in sys.path]

import numpy as np  # noqa: E402

from app.errors import UserError  # noqa: E402
from app.media.animation import animation_writer  # noqa: E402
from app.media.displacement import Displacement  # noqa: E402
from app.media.landmarks import Pairs, read_pairs, write_pairs  # noqa: E402
from app.media.maps import read_map, write_map  # noqa: E402
from app.media.pictures import write_picture  # noqa: E402
from app.media.project import from_picture, load, save  # noqa: E402
from app.media.recipes import read_recipe  # noqa: E402
from app.media.source import open_source  # noqa: E402
from app.model.picture import Picture  # noqa: E402
from app.model.recipe import Recipe  # noqa: E402
from app.model.strokes import Stroke  # noqa: E402
from app.model.undo import History  # noqa: E402
from app.work import journal  # noqa: E402

LONGEST = 5.0  # seconds
MOST_MEMORY = 2**30  # bytes beyond what a reader's process has before its first input
PICTURES = ".png", ".jpg", ".webp", ".avif", ".tif", ".exr", ".gif", ".bmp", ".tga", ".ppm"
CLIPS = ".mp4", ".webm", ".mov", ".mkv", ".apng"
PAGES = ".tif", ".gif", ".webp"
MOST_FRAMES = 8  # that are decoded of a clip
SIZE = 24, 20
MOST_PIXELS = 2**24  # that a picture may have here; what a person admits is another matter
RECIPE = """version = 5
picture = "cat.png"
duration = 0.06
[fluid]
grid = 32
[[viscosity]]
kind = "path"
points = [[0.1, 0.2], [0.8, 0.7]]
radius = 0.1
range = [0.001, 0.02]
[[freeze]]
kind = "picture"
picture = "cat.png"
[[force]]
kind = "vortex"
point = [0.5, 0.5]
radius = 0.3
strength = 5
formula = "1 + sin(3 * t) ** 2"
[[handle]]
at = [0.3, 0.4]
to = [0.5, 0.5]
rotate = 30
scale = 1.5
keys = [[1.5, 0.4, 0.5], [2, 0.4, 0.6]]
[[handle]]
points = [[0.2, 0.2], [0.4, 0.2], [0.3, 0.4]]
goals = [[0.2, 0.3], [0.4, 0.3], [0.3, 0.5]]
closed = true
[[pin]]
points = [[0.7, 0.7], [0.9, 0.8]]
stiffness = 0.5
[[mask]]
kind = "fill"
tick = 0
of = "frozen"
amount = 1
window = { box = [0.1, 0.1, 0.3, 0.2], shape = "ellipse" }
[[mask]]
kind = "fill"
tick = 1
of = "thickness"
amount = 2
segment = { at = [0.5, 0.5], color = "#808080", tolerance = 0.2 }
[[stroke]]
tool = "push"
muted = true
repeat = 3
every = 4
symmetry = "radial"
sectors = 5
samples = [[0, 0.3, 0.4, 1.0], [3, 0.6, 0.5, 0.5]]
"""
# What parsers trip over, for text and for binary files.
WORDS = [
    b"nan", b"-inf", b"1e999", b"-1", b"0", b"99999999999999999999", b"[", b"]]", b"{", b'"', b"\\u0000", b"=", b"\n",
    b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\x00\x00\x00\x00", b"\x80\x00\x00\x00", b"**", b"(" * 200, b"'" * 3,
]  # fmt: skip


def board() -> np.ndarray:
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    return np.stack([x * 9, y * 11, (x // 4 + y // 4) % 2 * 200], axis=-1).astype(np.uint8)


def make_picture(path: Path) -> None:
    if path.suffix in (".gif", ".bmp", ".tga", ".ppm"):
        from PIL import Image

        Image.fromarray(board()).save(path)
    else:
        write_picture(path, Picture(board()))


def make_clip(path: Path) -> None:
    with animation_writer(path, 25) as write:
        for number in range(3):
            write(np.roll(board(), number, axis=1))


def make_pages(path: Path) -> None:
    from PIL import Image

    frames = [Image.fromarray(np.roll(board(), number, axis=1)) for number in range(3)]
    frames[0].save(path, save_all=True, append_images=frames[1:])


def make_deep(path: Path) -> None:
    """16 bits with all that a picture may carry besides."""
    pixels = np.dstack([board(), np.full(SIZE[::-1], 200, np.uint8)]).astype(np.uint16) * 257
    chunks = {b"gAMA": (45455).to_bytes(4), b"cICP": bytes((9, 16, 0, 1)), b"cHRM": bytes(range(32))}
    write_picture(path, Picture(pixels, dpi=(300.0, 300.0), texts={"Title": "A board"}, chunks=chunks, xmp=b"<x/>"))


def make_layers(path: Path) -> None:
    """Two parts, the data windows of which lie beside the display window; half and whole floats, numbers of objects."""
    import OpenEXR

    values = board().astype(np.float32) / 255
    ids = np.arange(values[..., 0].size, dtype=np.uint32).reshape(SIZE[::-1])
    first = {"RGB": values, "Z": values[..., 0], "diffuse.RGB": values.astype(np.float16)}
    window = {"displayWindow": ((2, 1), (20, 15)), "dataWindow": ((0, 0), (SIZE[0] - 1, SIZE[1] - 1))}
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION, **window}
    parts = [OpenEXR.Part({**header, "name": "beauty", "owner": "nobody"}, first, "beauty")]
    parts.append(OpenEXR.Part({**header, "name": "ids"}, {"id": ids}, "ids"))
    OpenEXR.File(parts).write(str(path))


def make_recipe(path: Path) -> None:
    path.write_text(RECIPE)


def make_project(path: Path) -> None:
    write_picture(path.parent / "cat.png", Picture(board()))
    stroke = Stroke(tool="push", samples=((0, 0.3, 0.4, 1.0), (5, 0.6, 0.5, 0.5)))
    save(from_picture(path.parent / "cat.png", Recipe(picture="cat.png", stroke=(stroke,))), path)


def make_map(path: Path) -> None:
    values = 0.02 * np.random.default_rng(0).standard_normal((SIZE[1], SIZE[0], 2))
    write_map(path, Displacement(values.astype(np.float32)))


def make_pairs(path: Path) -> None:
    write_pairs(path, Pairs.points(np.random.default_rng(0).random((5, 2, 2))), SIZE)


def make_journal(path: Path) -> None:
    history = History(Recipe(picture="cat.png"))
    for number in range(4):
        stroke = Stroke(tool="push", samples=((number, 0.3, 0.4, 1.0), (number + 5, 0.6, 0.5, 0.5)))
        history.commit(f"Push {number}", history.recipe.edited(stroke=(*history.recipe.stroke, stroke)))
    work = journal.Work(tuple(history.entries), history.index, history.recipe)
    origin = journal.Origin("cat", "/nowhere", None, True, False, 100, 7)
    path.write_bytes(b"".join(journal.beginning(origin, work)))


def make_landmarks(path: Path) -> None:
    places = "\n".join(f"{x:.2f} {y:.2f}" for x, y in np.random.default_rng(0).random((5, 2)) * SIZE)
    path.write_text(f"version: 1\nn_points: 5\n{{\n{places}\n}}\n")


def read_landmarks(path: Path) -> None:
    """As both of the two files that are needed."""
    read_pairs([path, path], SIZE)


def read_frames(path: Path) -> None:
    """A picture, or a clip and its first frames."""
    clip = open_source(path, MOST_PIXELS).clip
    if clip is not None:
        with closing(clip.pictures()) as frames:
            for _ in islice(frames, MOST_FRAMES):
                pass


def read_journal(path: Path) -> None:
    with suppress(journal.Damaged, journal.Newer):
        journal.read(path.read_bytes())


Maker = Callable[[Path], None]
READERS: dict[str, tuple[Maker, Callable[[Path], object]]] = {
    **{f"picture{ending}": (make_picture, read_frames) for ending in PICTURES},
    **{f"clip{ending}": (make_clip, read_frames) for ending in CLIPS},
    **{f"pages{ending}": (make_pages, read_frames) for ending in PAGES},
    "deep.png": (make_deep, read_frames),
    "layers.exr": (make_layers, read_frames),
    **{
        f"map{ending}": (make_map, lambda path: read_map(path, max_pixels=MOST_PIXELS))
        for ending in (".exr", ".tif", ".flo", ".npy")
    },
    **{f"pairs{ending}": (make_pairs, lambda path: read_pairs([path], SIZE)) for ending in (".csv", ".tps")},
    "pairs.pts": (make_landmarks, read_landmarks),
    "recipe.toml": (make_recipe, read_recipe),
    "project.fluidwarp": (make_project, lambda path: load(path, MOST_PIXELS)),
    "journal.txt": (make_journal, read_journal),
}


def judged(reader: str, path: Path) -> None:
    """Let a reader read a file, or refuse it. Raises whatever else it does."""
    try:
        READERS[reader][1](path)
    except UserError as error:
        said = str(error)
    else:
        return
    if len(said.splitlines()) > 2 or not said.replace("\n", " ").isprintable():
        raise ValueError(f"not a message of two lines: {said!r}")


def damaged(whole: bytes, dice: random.Random) -> bytes:
    """Another file made of one: a few changes, each anywhere in it, and half of them near its beginning."""
    data = bytearray(whole)
    for _ in range(dice.choice((1, 1, 2, 4, 16))):
        most = max(len(data), 1) if dice.random() < 0.5 else min(max(len(data), 1), 256)
        at = dice.randrange(most)
        match dice.randrange(7):
            case 0:
                del data[at:]
            case 1:
                data[at : at + 1] = bytes([dice.randrange(256)])
            case 2:
                data[at : at + 1] = bytes([(data[at] if at < len(data) else 0) ^ 1 << dice.randrange(8)])
            case 3:
                word = dice.choice(WORDS)
                data[at : at + dice.choice((0, len(word)))] = word
            case 4:
                del data[at : at + dice.randrange(1, 64)]
            case 5:
                end = at + dice.randrange(1, 256)
                data[at:at] = bytes(data[at:end]) * dice.choice((1, 2, 50))
            case _:
                other = dice.randrange(max(len(whole), 1))
                data[at : at + 32] = whole[other : other + 32]
    return bytes(data)


def read_all(reader: str, first: int, count: int, seed: int, path: Path) -> None:
    """Read one input after another from `path`; tells of each before and after it, for the process that waits."""
    whole = whole_file(reader, path.parent)
    path.write_bytes(whole)
    READERS[reader][1](path)  # or damage would show nothing
    start = _peak()
    for number in range(first, first + count):
        path.write_bytes(damaged(whole, random.Random(f"{reader} {seed} {number}")))
        print("read", number, flush=True)
        begun, told = time.perf_counter(), "fine"
        try:
            judged(reader, path)
        except Exception as error:
            told = f"{type(error).__name__}: {error}".splitlines()[0]
        if (took := time.perf_counter() - begun) > LONGEST:
            told = f"took {took:.1f} s"
        if _peak() > start + MOST_MEMORY:
            told = f"took {(_peak() - start) >> 20} MiB"
            print("done", number, told, flush=True)
            return  # what comes after it could not be told from it
        print("done", number, told, flush=True)


def _peak() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def fuzz(reader: str, inputs: int, seed: int, findings: Path) -> list[str]:
    """Let processes read so many inputs, each as far as it comes; what was found, a line each."""
    found: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        path, number = Path(folder) / f"in{Path(reader).suffix}", 0
        while number < inputs:
            command = [sys.executable, __file__, "--child", reader, str(number), str(inputs - number), str(seed), path]
            child = subprocess.Popen([*map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            assert child.stdout is not None
            told = "the process did not begin"
            for line in child.stdout:
                state, at, *words = line.split(maxsplit=2)
                number, told = int(at), words[0].strip() if words else "the process ended"
                if state == "done" and told != "fine":
                    found.append(_keep(findings, reader, seed, number, told))
            child.wait()
            if told == "the process ended":
                found.append(_keep(findings, reader, seed, number, f"{told} with {child.returncode}"))
            elif told == "the process did not begin":
                return [*found, f"{reader}: {told}"]
            number += 1
    return found


def _keep(findings: Path, reader: str, seed: int, number: int, told: str) -> str:
    """A finding's input as a file, and what is said of it."""
    kept = findings / f"{reader.partition('.')[0]}-{seed}-{number}{Path(reader).suffix}"
    findings.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        kept.write_bytes(damaged(whole_file(reader, Path(folder)), random.Random(f"{reader} {seed} {number}")))
    return f"{kept}: {told}"


def whole_file(reader: str, folder: Path) -> bytes:
    """What the inputs of a reader are made of."""
    path = folder / f"whole{Path(reader).suffix}"
    READERS[reader][0](path)
    return path.read_bytes()


def main() -> int:
    if sys.argv[1:2] == ["--child"]:
        reader, first, count, seed, path = sys.argv[2:]
        read_all(reader, int(first), int(count), int(seed), Path(path))
        return 0
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--reader", nargs="*", default=list(READERS), help="a part of its name is enough")
    parser.add_argument("--inputs", type=int, default=1000, help="for each reader")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--findings", type=Path, default=Path("findings"))
    options = parser.parse_args()
    found: list[str] = []
    for reader in READERS:
        if any(wanted in reader for wanted in options.reader):
            begun = time.monotonic()
            here = fuzz(reader, options.inputs, options.seed, options.findings)
            print(
                f"{reader}: {options.inputs} inputs, {len(here)} findings, {time.monotonic() - begun:.0f} s", flush=True
            )
            found += here
    print(*found, sep="\n")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
