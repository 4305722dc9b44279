"""Files of several pictures as clips: animated GIF, APNG and WebP with their durations, and the pages of a TIFF."""

from __future__ import annotations

import json
import math
import os
import struct
import subprocess
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image

from app.errors import UserError
from app.media.clip import CHANGED
from app.media.codecs import pillow, tiff, webp
from app.media.displacement import Displacement
from app.media.maps import write_map
from app.media.source import open_source
from app.progress import Progress
from app.work.apply_job import Application, MapSource
from app.work.jobs import Outputs
from app.work.tasks import Task
from solver.gl.device import Device

WIDTH, HEIGHT = 40, 24
DURATIONS = [100, 250, 40, 40, 70]


def picture(number: int, alpha: bool = False) -> np.ndarray:
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    pixels = np.stack([(x // 8 % 2) * 200, (y // 6 % 2) * 180, np.full_like(x, 40 * number)], axis=-1).astype(np.uint8)
    if alpha:
        clear = np.where((x > 10) & (x < 14 + 4 * number), 0, 255).astype(np.uint8)
        return np.dstack([pixels * (clear[..., None] > 0), clear])
    return pixels


def animated(path: Path, alpha: bool = False, durations: list[int] | int = DURATIONS, **options: object) -> Path:
    frames = [Image.fromarray(picture(number, alpha)) for number in range(5)]
    lossless = {"lossless": True, "exact": True} if path.suffix == ".webp" else {}
    kind = {"format": "PNG"} if path.suffix == ".apng" else {}
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=durations, **lossless, **kind, **options)  # type: ignore[arg-type]
    return path


def shown(path: Path) -> tuple[list[np.ndarray], list[float], int | None]:
    """The frames, how many milliseconds each is shown and how often all are, as Pillow has them."""
    frames, durations = [], []
    with Image.open(path) as image:
        for number in range(image.n_frames):  # type: ignore[attr-defined]
            image.seek(number)
            frames.append(np.asarray(image.convert("RGBA")))
            durations.append(image.info["duration"])
        return frames, durations, image.info.get("loop")


def applied(device: Device, tmp_path: Path, source: Path, output: str, **options: object) -> tuple[str, ...]:
    write_map(tmp_path / "still.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    outputs = Outputs(tmp_path / output, **options)  # type: ignore[arg-type]
    order = Application(maps=MapSource(tmp_path / "still.npy"), picture=source, outputs=outputs)
    return order.perform(lambda: device, Progress()).notices


@pytest.mark.parametrize("ending", [".gif", ".apng", ".webp", ".png"])
@pytest.mark.parametrize("alpha", [False, True])
def test_the_frames_are_read_as_they_are_shown(tmp_path: Path, ending: str, alpha: bool):
    source = open_source(animated(tmp_path / f"a{ending}", alpha, loop=0))
    assert source.clip is not None
    seen = [frame.pixels for _, frame in source.clip.pictures()]
    expected = shown(tmp_path / f"a{ending}")[0]
    assert len(seen) == 5
    assert source.clip.alpha == alpha
    for mine, theirs in zip(seen, expected, strict=True):
        np.testing.assert_array_equal(mine, theirs if alpha else theirs[..., :3])
    rate = source.clip.fps or Fraction(1)
    moments = [source.clip.moment(number) / rate for number in range(5)]
    assert moments == [Fraction(sum(DURATIONS[:number]), 1000) for number in range(5)]


@pytest.mark.parametrize("ending", [".gif", ".apng"])
@pytest.mark.parametrize("into", [".gif", ".apng", ".mp4", ".mov", ".mkv", ".webm"])
def test_durations_are_kept(device: Device, tmp_path: Path, ending: str, into: str):
    """By Pillow's and ffprobe's measure; those of a part too."""
    source = animated(tmp_path / f"a{ending}", loop=0)
    for name, options, expected in (("b", {}, DURATIONS), ("c", {"part": (1, 3)}, DURATIONS[1:4])):
        assert not [said for said in applied(device, tmp_path, source, f"{name}{into}", **options) if "rate" in said]
        command = ["ffprobe", "-v", "error", "-show_entries", "packet=pts_time", "-of", "json", f"{name}{into}"]
        packets = json.loads(subprocess.run(command, capture_output=True, check=True, cwd=tmp_path).stdout)["packets"]
        times = sorted(float(packet["pts_time"]) for packet in packets)
        starts = [sum(expected[:number]) / 1000 for number in range(len(expected))]
        # The last frame of a video lasts a step: it comes once more where that step begins.
        again = [] if into in (".gif", ".apng") else [(sum(expected) - math.gcd(*DURATIONS)) / 1000]
        assert times == pytest.approx(starts + again, abs=1e-3)
        if into in (".gif", ".apng"):
            assert shown(tmp_path / f"{name}{into}")[1] == expected


def test_what_of_an_animation_another_kind_cannot_tell_is_told(device: Device, tmp_path: Path):
    source = animated(tmp_path / "a.gif", loop=3)
    for into, told in {
        "b.gif": [],
        "b.mp4": ["that it is played 4 times is not kept"],
        "b.%04d.png": ["how long its frames stand is not kept", "that it is played 4 times is not kept"],
    }.items():
        said = "; ".join(notice.partition(": ")[2] for notice in applied(device, tmp_path, source, into)).split("; ")
        assert [one for one in said if "stand" in one or "times" in one] == told


def test_durations_of_webp_are_kept(device: Device, tmp_path: Path):
    """`--animated` says that it is one; also of the last frame, for which ffmpeg takes a mean."""
    source = animated(tmp_path / "a.webp", loop=0)
    applied(device, tmp_path, source, "b.webp", animated=True)
    assert shown(tmp_path / "b.webp")[1] == DURATIONS
    # What is said of all of it comes before its frames; whatever comes after them is passed over.
    later = b"".join(
        kind + struct.pack("<I", len(body)) + body
        for kind, body in ((b"ANIM", bytes([0, 0, 0, 0, 7, 0])), (b"VP8X", bytes(10)))
    )
    whole = webp.frames(source.read_bytes())
    assert whole is not None
    assert webp.frames(source.read_bytes() + later) == whole


@pytest.mark.parametrize(("given", "plays"), [({"loop": 0}, 0), ({"loop": 3}, 3), ({}, None)])
def test_how_often_a_gif_plays_is_kept(device: Device, tmp_path: Path, given: dict[str, Any], plays: int | None):
    applied(device, tmp_path, animated(tmp_path / "a.gif", **given), "b.gif")
    assert shown(tmp_path / "b.gif")[2] == plays


def test_even_frames_have_a_rate(device: Device, tmp_path: Path):
    source = open_source(animated(tmp_path / "a.gif", durations=40))
    assert source.clip is not None
    assert (source.clip.fps, source.clip.durations, source.clip.frames) == (25, None, 5)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_pages_of_a_tiff_become_a_sequence(device: Device, tmp_path: Path, dtype: type):
    """Each with its own depth; a smaller version and a mask among them are no frames."""
    scale = 1 / 255 if dtype == np.float32 else 257 if dtype == np.uint16 else 1
    pages = [(picture(number) * np.float64(scale)).astype(dtype) for number in range(4)]
    with tifffile.TiffWriter(tmp_path / "a.tif") as writer:
        for number, page in enumerate(pages):
            writer.write(page, photometric="rgb", metadata=None)
            if number == 1:
                writer.write(page[::2, ::2], photometric="rgb", subfiletype=1, metadata=None)
    notices = applied(device, tmp_path, tmp_path / "a.tif", "b.%02d.tif")
    assert notices == ()
    for number, page in enumerate(pages):
        np.testing.assert_array_equal(tifffile.imread(tmp_path / f"b.{number:02d}.tif"), page)
    assert not (tmp_path / "b.04.tif").exists()


@pytest.mark.parametrize("ending", [".gif", ".apng", ".webp", ".tif"])
def test_a_clip_is_opened_once_for_all_its_frames(tmp_path: Path, ending: str, monkeypatch: pytest.MonkeyPatch):
    """Once for each, of many frames the time grew with the square."""
    if ending == ".tif":
        with tifffile.TiffWriter(tmp_path / "a.tif") as writer:
            for number in range(5):
                writer.write(picture(number), photometric="rgb", metadata=None)
    else:
        animated(tmp_path / f"a{ending}")
    clip = open_source(tmp_path / f"a{ending}").clip
    assert clip is not None
    opened = list[Any]()

    def counting(open_it: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *args: opened.append(args) or open_it(*args)

    for module in (tiff, pillow):
        monkeypatch.setattr(module, "opened", counting(module.opened))
    assert len(list(clip.pictures((1, None), is_kept=lambda number: number == 2))) == 3
    assert len(opened) == 1


def test_a_still_takes_the_first_and_says_so(device: Device, tmp_path: Path):
    notices = applied(device, tmp_path, animated(tmp_path / "a.gif"), "b.png")
    assert notices == ("a.gif: of its 5 frames only the first is used",)
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "b.png")), shown(tmp_path / "a.gif")[0][0][..., :3])


def test_a_recipe_moves_with_the_durations(device: Device, tmp_path: Path):
    """The frame that is shown at 0.35 s has the warp of then: that of a clip of 100 frames a second there."""
    recipe = 'duration = 0.5\n[fluid]\ngrid = 32\ndt = 0.01\n[[force]]\nkind = "vortex"\n'
    (tmp_path / "a.toml").write_text(recipe + "point = [0.5, 0.5]\nradius = 0.3\nstrength = 4\n[output]\nfps = 100\n")
    animated(tmp_path / "a.apng", loop=0)
    Image.fromarray(picture(2)).save(tmp_path / "one.png")
    for source, output in (("a.apng", "a.%02d.png"), ("one.png", "one.%02d.png")):
        outputs = Outputs(tmp_path / output)
        task = Task(recipe=str(tmp_path / "a.toml"), edits={}, picture=tmp_path / source, outputs=outputs)
        task.perform(lambda: device, Progress())
    mine, theirs = (np.asarray(Image.open(tmp_path / name)) for name in ("a.02.png", "one.35.png"))
    np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize("name", ["a.gif", "a.apng", "a.webp", "a.tif"])
def test_what_is_damaged_in_the_middle_is_told(device: Device, tmp_path: Path, name: str):
    if name == "a.tif":
        with tifffile.TiffWriter(tmp_path / name) as writer:
            for number in range(5):
                writer.write(picture(number), photometric="rgb", metadata=None, compression="zlib")
    else:
        animated(tmp_path / name)
    data = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(data[: len(data) * 2 // 3])
    with pytest.raises(UserError, match=r"^Cannot read .*(damaged|truncated)[^\n]*$"):
        applied(device, tmp_path, tmp_path / name, "b.mp4")


def test_pages_of_several_sizes_are_told(device: Device, tmp_path: Path):
    with tifffile.TiffWriter(tmp_path / "a.tif") as writer:
        writer.write(picture(0), photometric="rgb", metadata=None)
        writer.write(picture(1)[:-4], photometric="rgb", metadata=None)
    with pytest.raises(UserError, match=r"a\.tif: frame 1 has 40 x 20 pixels of 3 x 8 bits, unlike the first"):
        applied(device, tmp_path, tmp_path / "a.tif", "b.mp4")
    with pytest.raises(UserError, match="it has the frames 0-1, and none from 7 on"):
        applied(device, tmp_path, tmp_path / "a.tif", "b.mp4", part=(7, None))


@pytest.mark.parametrize("ending", [".gif", ".webp", ".apng"])
@pytest.mark.parametrize("other", ["gone", "shorter", "empty", "larger", "still", "pipe", "folder"])
def test_a_file_that_another_has_taken_the_place_of_is_told(tmp_path: Path, ending: str, other: str):
    if other == "pipe" and not hasattr(os, "mkfifo"):
        pytest.skip("pipes are no files here")
    path, new = animated(tmp_path / f"a{ending}"), tmp_path / f"new{ending}"
    clip = open_source(path).clip
    assert clip is not None
    pictures = clip.pictures()
    assert next(pictures)[0] == 0
    whole, kind = path.read_bytes(), {".apng": "PNG"}.get(ending)
    if other in ("shorter", "empty"):
        path.write_bytes(whole[: len(whole) // 3 if other == "shorter" else 0])
    elif other in ("larger", "still"):
        size = (2 * WIDTH, HEIGHT) if other == "larger" else (WIDTH, HEIGHT)
        Image.new("RGB", size).save(new, format=kind)
        new.replace(path)
    else:
        path.unlink()
        {"gone": lambda: None, "pipe": lambda: os.mkfifo(path), "folder": path.mkdir}[other]()
    with pytest.raises(UserError) as error:
        list(pictures)
    sizes = f"from {len(whole)} to {path.stat().st_size if path.exists() else 0} bytes"
    said = {
        "gone": "there is no such file; check the name.",
        "pipe": "it is a pipe or a device; save it as an ordinary file first.",
        "folder": "it is a folder; give the name of a clip.",
    }.get(other, f"it changed while it was read, {sizes}; start again when it is written whole.")
    assert str(error.value) == f"Cannot read {path}: {said}"
    assert error.value.status == (CHANGED if path.is_file() else 1)
