"""Damaged files of every kind into every command: done, or told in one sentence with nothing left behind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest
from PIL import Image

from app.media.animation import animation_writer
from app.media.displacement import Displacement
from app.media.maps import write_map
from app.media.pictures import write_picture
from app.media.project import from_recipe, save
from app.model.picture import Picture

RECIPE = """
version = 1
picture = "cat.png"
duration = 0.06
[fluid]
grid = 32
[[viscosity]]
kind = "picture"
picture = "cat.png"
scale = 0.01
[[force]]
kind = "vortex"
point = [0.5, 0.5]
radius = 0.3
strength = 5
"""
PICTURES = [".png", ".16.png", ".jpg", ".webp", ".avif", ".tif", ".exr", ".gif", ".bmp", ".tga", ".ppm"]
CLIPS = [".mp4", ".webm", ".mkv", ".mov"]
MAPS = [".exr", ".tif", ".flo", ".npy"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "a.toml").write_text(RECIPE)
    write_picture(tmp_path / "cat.png", Picture(smooth()))
    write_map(tmp_path / "still.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    return tmp_path


def smooth() -> np.ndarray:
    y, x = np.mgrid[0:48, 0:64]
    noise = np.random.default_rng(0).integers(0, 9, (48, 64, 3))
    return (np.stack([x * 3, y * 4, x + y], axis=-1) + noise).astype(np.uint8)


def picture(folder: Path, ending: str) -> Path:
    path = folder / f"in{ending}"
    if ending in (".gif", ".bmp", ".tga", ".ppm"):
        Image.fromarray(smooth()).save(path)
    else:
        write_picture(path, Picture(smooth() * np.uint16(257) if "16" in ending else smooth()))
    return path


def clip(folder: Path, ending: str) -> Path:
    path = folder / f"in{ending}"
    with animation_writer(path, 25) as write:
        for number in range(4):
            write(np.roll(smooth(), 3 * number, axis=1))
    return path


def warp_map(folder: Path, ending: str) -> Path:
    path = folder / f"in{ending}"
    values = 0.02 * np.random.default_rng(0).standard_normal((48, 64, 2))
    write_map(path, Displacement(values.astype(np.float32)))
    return path


def project(folder: Path, ending: str) -> Path:
    path = folder / f"in{ending}"
    if ending == ".toml":
        path.write_text(RECIPE)
    else:
        save(from_recipe(folder / "a.toml"), path)
    return path


COMMANDS: dict[str, tuple[Callable[[Path, str], Path], list[str], list[list[str]], int]] = {
    "pictures": (
        picture,
        PICTURES,
        [["render", "a.toml", "-i", "IN", "-o", "out.png"], ["apply", "still.npy", "IN", "-o", "out.tif"]],
        12,
    ),
    "clips": (clip, CLIPS, [["render", "a.toml", "-i", "IN", "-o", "out.mp4"]], 6),
    "maps": (
        warp_map,
        MAPS,
        [["apply", "IN", "cat.png", "-o", "out.png"], ["convert", "IN", "-o", "out.exr"]],
        12,
    ),
    "recipes": (project, [".toml", ".fluidwarp"], [["render", "IN", "-o", "out.png"]], 20),
}


@pytest.mark.parametrize(("kind", "ending"), [(kind, ending) for kind in COMMANDS for ending in COMMANDS[kind][1]])
def test_a_damaged_file_is_used_or_refused_in_a_sentence(
    folder: Path,
    kind: str,
    ending: str,
    fluidwarp: Callable[..., CompletedProcess[str]],
):
    make, _, commands, rounds = COMMANDS[kind]
    path = make(folder, ending)
    whole = path.read_bytes()
    random = np.random.default_rng(len(ending) + len(whole))
    before = contents(folder)
    told = 0
    for number in range(rounds):
        path.write_bytes(damaged(whole, random, number))
        for command in commands:
            ran = fluidwarp(folder, *[path.name if word == "IN" else word for word in command])
            assert ran.stdout == ""
            status, said, output = ran.returncode, ran.stderr, folder / command[-1]
            lines = said.splitlines()
            if status == 0:
                assert output.stat().st_size > 0
                output.unlink()
                told += bool(said)  # of a clip: that it is damaged, and was used as far as it goes
            else:
                told += 1
                assert len(lines) == 1, said
                assert lines[0].startswith("fluidwarp: ")
                # Of another size than it was, it may be no fault of the file.
                assert path.name in lines[0] or "pixels" in lines[0] or "same proportions" in lines[0], said
            assert contents(folder) == before
    assert told > 0
    # The whole file is taken, and so the refusals were not for something else.
    path.write_bytes(whole)
    for command in commands:
        ran = fluidwarp(folder, *[path.name if word == "IN" else word for word in command])
        assert (ran.returncode, ran.stdout) == (0, "")
        (folder / command[-1]).unlink()


def damaged(whole: bytes, random: np.random.Generator, number: int) -> bytes:
    """Cut off somewhere, or with bytes changed anywhere or among the first, or with a stretch lost or doubled."""
    data = bytearray(whole)
    at, other = sorted(int(place) for place in random.integers(1, len(whole), 2))
    match number % 4:
        case 0:
            return bytes(data[:at])
        case 1:
            for place in random.integers(0, len(data), 8):
                data[place] = random.integers(256)
        case 2:
            for place in random.integers(0, min(200, len(data)), 3):
                data[place] ^= 1 << int(random.integers(8))
        case _:
            data[at:other] = data[at:other] * 2 if number % 8 == 3 else b""
    return bytes(data)


def contents(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())
