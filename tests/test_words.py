"""What each word of the command line does to what is written and said, as `golden/words.txt` has it in sums."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from PIL import Image

from app.media.pictures import read_picture, write_picture
from app.model.picture import Picture
from solver.gl.device import Device
from support.commands import Run
from support.golden import Golden, Sum

CLOSE = 5e-3
MACHINE = "milliseconds", "opengl"  # of the numbers: what is not of the result
RECIPE = """
picture = "cat.png"
duration = 0.1
fluid = { grid = 16, dt = 0.02, viscosity = 0.01 }
output = { fps = 25 }
force = [{ kind = "vortex", point = [0.4, 0.5], radius = 0.3, strength = 20 }]
"""
RENDERED = {
    "nothing": "", "a JPEG": "-o a.jpg", "its quality": "-o a.jpg --quality 30", "a WebP": "-o a.webp --quality 30",
    "animated": "-o a.webp --animated", "a TIFF": "-o a.tif --bits 16", "floats": "-o a.exr --bits 32",
    "halves": "-o a.exr --bits 16 --codec piz", "8 bits": "-o a.tif --bits 8", "stripped": "-o a.png --strip",
    "dpi": "-o a.tif --dpi 300", "dpi of a WebP": "-o a.webp --dpi 300", "dpi of frames": "-o f.%02d.png --dpi 300",
    "not stripped": "-o a.png -i tagged.png", "tagged, stripped": "-o a.png -i tagged.png --strip",
    "another picture": "-i dog.png", "several": "cat.png dog.png -o made", "by name": "cat.png dog.png -o {name}-a.png",
    "size": "--size 40", "grid": "--grid 24", "solver": "--solver paper", "duration": "--duration 0.04",
    "amount": "--amount 0.5", "frames": "-o f.%02d.png", "fps": "-o f.%02d.png --fps 50",
    "from": "-o f.%02d.png --from 0.04", "to": "-o f.%02d.png --to 0.04", "part": "-o f.%02d.png --frames 1-2",
    "one frame": "-o f.%02d.png --frames 1", "the rest": "-o f.%02d.png --frames 1-", "a GIF": "-o a.gif",
    "numbers": "--stats s.json", "numbers of frames": "-o f.%02d.png --stats s.json", "an EXR map": "--map m.exr",
    "a map": "--map m.npy", "forward": "--map m.npy --forward", "offsets": "--map m.exr --offsets",
    "overscan": "--map m.npy --overscan 3", "map size": "--map m.npy --map-size 20", "maps": "--map m.%02d.npy",
    "states": "-o a.png --states kept", "too large": "--max-pixels 100", "resumed": "-o f.%02d.png --resume",
    "a tif map": "--map m.tif", "a flo map": "--map m.flo", "no part": "--frames 1", "no map": "--forward",
}  # fmt: skip
APPLIED = {
    "map": "", "edges": "--edges mirror", "black": "--edges black", "wrapped": "--edges wrap",
    "clamped": "--edges clamp", "size": "--size 40", "bits": "--bits 16 -o a.tif", "as offsets": "--kind offsets",
    "corners": "--grid corners", "pixels": "--grid pixels", "overscan": "--overscan 2",
    "a wrong kind": "--kind other", "a wrong grid": "--grid other", "a wrong edge": "--edges other",
    "quality": "-o a.jpg --quality 20", "stripped": "-o a.png --strip", "too large": "--max-pixels 100",
}  # fmt: skip
CONVERTED = {
    "npy": "-o b.npy", "tif": "-o b.tif", "flo": "-o b.flo", "offsets": "-o b.exr --offsets",
    "inverted": "-o b.npy --invert", "from offsets": "-o b.npy --kind offsets",
    "too large": "-o b.npy --max-pixels 100", "from corners": "-o b.npy --grid corners", "cut": "-o b.npy --overscan 1",
}  # fmt: skip
TOGETHER = {"render": 8, "apply": 16, "convert": 16}  # lines of the words of three others
SIDES = 1, 2, 5, 6  # of pictures and maps that are too small for one thing or another


def together(command: str, lines: list[str]) -> dict[str, str]:
    """The words of three of the lines at once, by chance: what one does may depend on another."""
    dice = Random(command)
    # With the others nothing comes of what they stand with.
    ways = [line for line in lines if line and not line.endswith((" 100", " other", "--forward", "--frames 1", " 300"))]
    made = dict[str, str]()
    for number in range(TOGETHER[command]):
        words = " ".join(dice.sample(ways, 3)).split()
        outputs = [at for at, word in enumerate(words) if word == "-o"]
        for at in reversed(outputs[1:]):
            del words[at : at + 2]
        made[f"{number} {' '.join(words)}"] = " ".join(words if outputs else [*words, "-o", "a.png"])
    return made


def held(file: Path) -> Any:
    """What is in a file."""
    if file.suffix == ".npy":
        return np.load(file)
    if file.suffix == ".json":
        return json.loads(
            file.read_text(), object_hook=lambda table: {key: table[key] for key in table if key not in MACHINE}
        )
    if file.suffix == ".flo":
        return np.frombuffer(file.read_bytes()[12:], np.float32)
    if file.suffix in (".gif", ".webp"):
        with Image.open(file) as clip:
            frames = []
            for number in range(getattr(clip, "n_frames", 1)):
                clip.seek(number)
                frames.append([clip.info.get("duration"), np.asarray(clip.convert("RGBA"))])
            if file.suffix == ".gif" or len(frames) > 1:
                return [clip.info.get("loop"), frames]
    if file.suffix in (".png", ".jpg", ".webp", ".tif", ".exr"):
        picture = read_picture(file)
        kept = {name: part is not None and len(part) for name, part in vars(picture).items() if isinstance(part, bytes)}
        return [picture.pixels, str(picture.pixels.dtype), picture.dpi, kept, dict(picture.texts)]
    return None


def _of_the_result(table: dict[str, Any]) -> dict[str, Any]:
    return {key: part for key, part in table.items() if key not in MACHINE}


@pytest.fixture(scope="module")
def golden(shared_device: Device) -> Iterator[Golden]:
    with Golden.of_software(shared_device, "words.txt") as golden:
        yield golden


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    y, x = np.mgrid[0:24, 0:32]
    for name, turned in (("cat", False), ("dog", True)):
        pixels = np.stack([x * 7, y * 9, (x + y) % 8 * 30], axis=-1).astype(np.uint8)
        write_picture(tmp_path / f"{name}.png", Picture(pixels[::-1] if turned else pixels))
    write_picture(tmp_path / "tagged.png", Picture(pixels, dpi=(300.0, 300.0), texts={"Author": "somebody"}))
    displaced = np.stack([0.1 * np.sin(y / 5), 0.08 * np.cos(x / 4)], axis=-1).astype(np.float32)
    places = np.stack([(x + 0.5) / 32, 1 - (y + 0.5) / 24], axis=-1) + displaced
    np.save(tmp_path / "given.npy", displaced * 32)
    write_picture(tmp_path / "given.exr", Picture(np.dstack([places, 0 * x]).astype(np.float32)))
    for side in SIDES:
        write_picture(tmp_path / f"{side}.png", Picture(pixels[:side, :side]))
        np.save(tmp_path / f"{side}.npy", displaced[:side, :side] * side)
    (tmp_path / "a.toml").write_text(RECIPE)
    return tmp_path


@pytest.mark.parametrize("command", ["render", "apply", "convert"])
def test_every_word_does_what_it_did(folder: Path, fluidwarp: Run, golden: Golden, command: str) -> None:
    given, lines = {
        "render": ("a.toml", RENDERED),
        "apply": ("given.exr cat.png", {name: words if "-o " in words else f"-o a.png {words}"
                                        for name, words in APPLIED.items()}),
        "convert": ("given.exr", CONVERTED),
    }[command]  # fmt: skip
    before = set(folder.rglob("*"))
    found: dict[str, list[float]] = {}
    lines = {name: f"{given} {words}" for name, words in (lines | together(command, [*lines.values()])).items()}
    for side in SIDES:
        lines[f"{side} a side"] = {
            "render": f"a.toml -i {side}.png -o a.png --map m.npy", "apply": f"{side}.npy {side}.png -o a.png",
            "convert": f"{side}.npy -o b.npy --invert",
        }[command]  # fmt: skip
        lines[f"{side} a side, the other way"] = {
            "render": f"a.toml --size {side} -o a.png", "apply": f"given.exr {side}.png -o a.png",
            "convert": f"{side}.npy -o b.exr --offsets",
        }[command]  # fmt: skip
    for name, words in lines.items():
        run = fluidwarp(folder, command, *words.split())
        summed = Sum(1.0 if "map" not in name else 100.0)
        summed.add([run.returncode, run.stdout, re.sub(r"\d+(\.\d+)? s\b", "", run.stderr)])
        for file in sorted(set(folder.rglob("*")) - before, reverse=True):
            if file.is_dir():
                file.rmdir()
                continue
            summed.add([re.sub("[0-9a-f]{16,}", "DIGEST", str(file.relative_to(folder))), held(file)])
            file.unlink()
        found[f"{command}: {name}".replace(": ", " ")] = summed.row
    golden.compare_all(found, f"{command} ", CLOSE)
