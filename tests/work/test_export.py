"""Clips and maps through the program: what is written, as other programs and other ways to it have it."""

from __future__ import annotations

import json
import os
import re
import subprocess
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy import ndimage

from app.errors import Cancelled, UserError
from app.gallery.measures import sharpness, spline_warp
from app.media import ffmpeg
from app.media.auxiliary import Pictures
from app.media.depth import to_bits
from app.media.displacement import Displacement, cropped, to_st
from app.media.files import takes_place
from app.media.maps import read_map, write_map
from app.media.numbered import is_sequence
from app.media.pictures import read_picture, write_picture
from app.media.source import open_source
from app.media.video import read_clip
from app.model.picture import Picture, srgb_to_linear
from app.model.recipe import Recipe
from app.model.timeline import Timeline
from app.progress import Progress
from app.work import export
from app.work.apply_job import Application, MapSource, converted, inverted
from app.work.export import Target, displacement, looked_up, run, shown_positions, writers_for
from app.work.jobs import Job, MapOutput, Outputs
from app.work.replay import Replay
from solver.gl.device import Device
from solver.resample.plan import GivenMap, Sampling
from solver.resample.sampler import Sampler

WIDTH, HEIGHT = 96, 64
WHIRL = """
duration = 0.4
edges = "clamp"
[fluid]
grid = 48
dt = 0.02
[[force]]
kind = "vortex"
point = [0.45, 0.5]
radius = 0.3
strength = 6
[output]
fps = 10
"""


def scene(number: int = 0) -> np.ndarray:
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    light = 128 + 60 * np.sin(x / 7 + number / 3) + 50 * np.cos(y / 9)
    return np.stack([light, 250 - light, (light + x) / 2], axis=-1).astype(np.uint8)


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    write_picture(tmp_path / "cat.png", Picture(scene()))
    return tmp_path / "cat.png"


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lossless clip of 9 frames at 12.5 a second, with a sound."""
    path = tmp_path_factory.mktemp("clip") / "clip.mkv"
    frames = b"".join(scene(number).tobytes() for number in range(9))
    command = [ffmpeg.executable(), "-v", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{WIDTH}x{HEIGHT}"]
    command += ["-r", "25/2", "-i", "-", "-f", "lavfi", "-i", "sine=d=0.72", "-c:v", "ffv1", "-pix_fmt", "bgr0"]
    subprocess.run([*command, "-c:a", "flac", str(path)], input=frames, check=True)
    return path


def test_a_grid_far_finer_than_the_picture_is_told_before_it_takes_its_time(device: Device, tmp_path: Path) -> None:
    """It took a minute without a word."""
    order = list[str]()
    outputs, small = Outputs(tmp_path / "x.png"), Picture(scene())

    def step(done: int, total: int | None) -> None:
        if done:
            order.append("step")

    for cells, is_told, hears in (384, False, True), (388, True, True), (388, True, False):
        order.clear()
        recipe = Recipe.parse(WHIRL).on_grid(cells).edited(duration=0.02)
        report = run(
            device, Job(recipe, small, tmp_path, outputs), Progress(warn=order.append if hears else None, report=step)
        )
        said = "a grid of 388 cells is 4.04 times as fine as the picture of 96 x 64 pixels, and takes long; "
        said += "one of 96 is as fine"
        assert list(report.notices) == [said] * (is_told and not hears), "with the result, if nobody heard of it before"
        assert order[:2] == ([said, "step"] if is_told and hears else ["step", "step"])


def render(device: Device, recipe: str, source: Path, output: Path | None, **options: object) -> None:
    opened = open_source(source)
    outputs = Outputs(output, **options)  # type: ignore[arg-type]
    job = Job(Recipe.parse(recipe), opened.picture, source.parent, outputs, opened.clip)
    job.check()
    run(device, job, Progress())


def apply(device: Device, maps: Path, source: Path, output: Path, **options: object) -> None:
    applied(maps, source, output, **options).perform(lambda: device, Progress())


def applied(maps: Path, source: Path, output: Path, **options: object) -> Application:
    return Application(
        maps=MapSource(maps),
        picture=source,
        outputs=Outputs(output),
        **{"edges": "clamp", **options},  # type: ignore[arg-type]
    )


def files(folder: Path, start: str) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.name.startswith(start))


def probe(path: Path) -> dict[str, dict]:
    command = ["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", str(path)]
    streams = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)["streams"]
    return {stream["codec_type"]: stream for stream in streams}


def replayed(device: Device, recipe: str, picture: Path, ticks: int) -> Replay:
    replay = Replay(device, Recipe.parse(recipe), Pictures(read_picture(picture), picture.parent), budget=0)
    replay.seek(ticks)
    return replay


# Clips --------------------------------------------------------------------------------------------------------------


def test_a_clip_is_warped_frame_by_frame(device: Device, clip: Path, tmp_path: Path):
    """Frame k by the warp of frame k at the clip's rate, and by the last warp once the fluid has come to its end."""
    render(device, WHIRL, clip, tmp_path / "f.%02d.png", maps=MapOutput(tmp_path / "m.%02d.npy"))
    assert files(tmp_path, "f.") == [f"f.{number:02d}.png" for number in range(9)]
    for number in (0, 3, 5, 8):
        write_picture(tmp_path / "still.png", Picture(scene(number)))
        # 0.4 s are 5 frames after the first
        at = min(number, 5)
        expected = scene(0).astype(int)
        if at:
            recipe = WHIRL.replace("duration = 0.4", f"duration = {at * 0.08:g}")
            render(device, recipe, tmp_path / "still.png", tmp_path / "end.png")
            expected = read_picture(tmp_path / "end.png").pixels.astype(int)
        made = read_picture(tmp_path / f"f.{number:02d}.png").pixels.astype(int)
        assert np.abs(made - expected).max() <= 1, number


@pytest.mark.parametrize("ending", [".mp4", ".mkv"])
def test_a_clip_keeps_its_rate_and_its_sound(device: Device, clip: Path, tmp_path: Path, ending: str):
    render(device, WHIRL, clip, tmp_path / f"out{ending}")
    found = probe(tmp_path / f"out{ending}")
    assert found["video"]["nb_read_frames"] == "9"
    assert Fraction(found["video"]["r_frame_rate"]) == Fraction(25, 2)
    assert found["audio"]["codec_name"] == {".mp4": "aac", ".mkv": "flac"}[ending]
    made = read_clip(tmp_path / f"out{ending}")
    assert (made.width, made.height) == (WIDTH, HEIGHT)


def test_a_clip_goes_back_in_time_with_its_warp(device: Device, clip: Path, tmp_path: Path):
    """The clip itself goes on forwards: its frame 5 by the first warp, which does nothing."""
    render(device, WHIRL + "[time]\nreverse = true\n", clip, tmp_path / "f.%02d.png")
    assert np.array_equal(read_picture(tmp_path / "f.05.png").pixels, scene(5))
    assert (read_picture(tmp_path / "f.00.png").pixels != scene(0)).any()


def test_a_part_of_a_clip(device: Device, clip: Path, tmp_path: Path):
    render(device, WHIRL, clip, tmp_path / "f.%02d.png")
    render(device, WHIRL, clip, tmp_path / "part.%02d.png", part=(4, 6))
    assert files(tmp_path, "part") == ["part.04.png", "part.05.png", "part.06.png"]
    render(device, WHIRL, clip, tmp_path / "last.%02d.png", part=(8, None))
    assert files(tmp_path, "last") == ["last.08.png"]
    for first in (9, 100):
        with pytest.raises(UserError, match=rf"^the clip has the frames 0-8, and none from {first} on$"):
            render(device, WHIRL, clip, tmp_path / "none.%02d.png", part=(first, None))
    assert files(tmp_path, "none") == []
    for number in (4, 5, 6):
        assert (tmp_path / f"part.{number:02d}.png").read_bytes() == (tmp_path / f"f.{number:02d}.png").read_bytes()


def test_a_part_of_a_clip_has_its_part_of_the_sound(device: Device, tmp_path: Path):
    """A clip whose sound rises in pitch: that of frames 4-8 is of their 0.4 s, up to the encoder's blocks."""
    source, rising = tmp_path / "rising.mkv", "aevalsrc=sin(2*PI*(500+1000*t)*t):d=2:s=44100"
    command = [ffmpeg.executable(), "-v", "error", "-f", "lavfi", "-i", f"testsrc=s={WIDTH}x{HEIGHT}:r=25/2:d=2"]
    subprocess.run([*command, "-f", "lavfi", "-i", rising, "-c:v", "ffv1", "-c:a", "flac", str(source)], check=True)
    for ending in (".mkv", ".mp4"):
        render(device, WHIRL, source, tmp_path / f"part{ending}", part=(4, 8))
        heard, whole = (sound(path) for path in (tmp_path / f"part{ending}", source))
        assert len(heard) / 44100 == pytest.approx(5 / 12.5, abs=0.05), ending
        assert float(probe(tmp_path / f"part{ending}")["video"]["start_time"]) == pytest.approx(0, abs=0.03)
        # where a window from the middle of the part lies in the whole
        window = heard[len(heard) // 2 :][:2048]
        offsets = np.arange(0, len(whole) - 2048, 16)
        likeness = [whole[offset : offset + 2048] @ window for offset in offsets]
        assert (offsets[np.argmax(likeness)] - len(heard) // 2) / 44100 == pytest.approx(4 / 12.5, abs=0.03), ending


@pytest.mark.parametrize("late", [0.025, 1.0])
def test_a_clip_whose_frames_begin_after_its_sound(device: Device, tmp_path: Path, late: float):
    """No frame of it comes twice, and the sound stays with the frames: it beeps from the third frame on."""
    source = tmp_path / "late.mkv"
    command = [ffmpeg.executable(), "-v", "error", "-itsoffset", str(late), "-f", "lavfi"]
    command += ["-i", f"testsrc=s={WIDTH}x{HEIGHT}:r=25:d=0.4", "-f", "lavfi", "-i"]
    beeps = f"aevalsrc=gte(t\\,{late + 3 / 25})*sin(3000*t):d={late + 0.4}:s=44100"
    subprocess.run([*command, beeps, "-c:v", "ffv1", "-c:a", "flac", str(source)], check=True)
    read = read_clip(source)
    assert read.frames == 10
    shown = list(read.read_frames())
    assert len(shown) == 10
    assert all((one != other).any() for one, other in pairwise(shown))
    write_map(tmp_path / "m.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    render(device, WHIRL, source, tmp_path / "out.mkv")
    apply(device, tmp_path / "m.npy", source, tmp_path / "again.mkv")
    for name in ("out.mkv", "again.mkv"):
        starts = probe(tmp_path / name)
        assert starts["video"]["nb_read_frames"] == "10"
        silent = np.flatnonzero(np.abs(sound(tmp_path / name)) > 0.1)[0] / 44100
        begins = float(starts["audio"]["start_time"]) - float(starts["video"]["start_time"])
        assert begins + silent == pytest.approx(3 / 25, abs=0.03)  # up to a block of what is copied


def sound(path: Path) -> np.ndarray:
    """The samples of a file's sound, 44,100 a second."""
    command = [ffmpeg.executable(), "-v", "error", "-i", str(path), "-map", "0:a", "-ac", "1", "-ar", "44100"]
    return np.frombuffer(subprocess.run([*command, "-f", "f32le", "-"], capture_output=True, check=True).stdout, "f4")


def test_a_clip_through_a_still_map(device: Device, clip: Path, picture: Path, tmp_path: Path):
    render(device, WHIRL, picture, None, maps=MapOutput(tmp_path / "m.exr"))
    apply(device, tmp_path / "m.exr", clip, tmp_path / "f.%02d.png")
    write_picture(tmp_path / "still.png", Picture(scene(7)))
    apply(device, tmp_path / "m.exr", tmp_path / "still.png", tmp_path / "one.png")
    assert np.array_equal(read_picture(tmp_path / "f.07.png").pixels, read_picture(tmp_path / "one.png").pixels)
    apply(device, tmp_path / "m.exr", clip, tmp_path / "out.mkv")
    assert {"video", "audio"} == set(probe(tmp_path / "out.mkv"))


@pytest.mark.parametrize(
    ("fps", "exact"),
    [("23.976", "24000/1001"), ("29.97", "30000/1001"), ("47.952", "48000/1001"), ("59.94", "60000/1001"),
     ("119.88", "120000/1001"), ("23.98", "1199/50"), ("12.5", "25/2"), ("25", "25/1")],
)  # fmt: skip
def test_the_rates_of_ntsc_are_exact(device: Device, picture: Path, tmp_path: Path, fps: str, exact: str):
    recipe = WHIRL.replace("fps = 10", f"fps = {fps}").replace("duration = 0.4", "duration = 0.1")
    render(device, recipe, picture, tmp_path / "out.mp4", maps=MapOutput(tmp_path / "m.%03d.npy"))
    assert probe(tmp_path / "out.mp4")["video"]["r_frame_rate"] == exact
    apply(device, tmp_path / "m.%03d.npy", picture, tmp_path / "again.mp4", fps=float(fps))
    assert probe(tmp_path / "again.mp4")["video"]["r_frame_rate"] == exact


# Maps ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("time", "order"),
    [
        ("", [0, 1, 2, 3, 4]),
        ("hold_first = 0.1\nhold_last = 0.2", [0, 0, 1, 2, 3, 4, 4, 4]),
        ("reverse = true\nhold_last = 0.1", [4, 3, 2, 1, 0, 0]),
        ("ping_pong = true\nhold_first = 0.1", [0, 0, 1, 2, 3, 4, 3, 2, 1]),
        ("start = 0.1\nend = 0.3\nspeed = 0.5", [1, 1.5, 2, 2.5, 3]),
    ],
)
def test_the_order_in_which_warps_are_shown(time: str, order: list[float]):
    """Ten frames a second, a tick each."""
    recipe = Recipe.parse(f"duration = 0.4\n[fluid]\ndt = 0.1\n[time]\n{time}\n")
    assert shown_positions(Timeline.of(recipe), recipe, 10) == (order, {})


@pytest.mark.parametrize("time", ["", "reverse = true", "ping_pong = true", "dissolve = 0.2", "hold_last = 0.1"])
def test_each_tick_is_simulated_once_whichever_way_an_animation_goes(
    device: Device, picture: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, time: str
) -> None:
    """As often as it is promised, which is what the bar of progress shows."""
    ticks, advance, progress = list[int](), Replay.advance, Progress()

    def noting(replay: Replay) -> None:
        advance(replay)
        ticks.append(replay.tick)

    monkeypatch.setattr(Replay, "advance", noting)
    recipe = Recipe.parse(f"{WHIRL}\n[time]\n{time}\n")
    job = Job(recipe, read_picture(picture), tmp_path, Outputs(tmp_path / "a.gif"))
    run(device, job, progress)
    assert ticks == sorted(set(ticks))
    assert progress.done == progress.total


def test_a_loop_is_dissolved_of_the_frames_that_there_are(device: Device, picture: Path, tmp_path: Path):
    """Also where a part of it is made alone."""
    head = "duration = 0.8\n[fluid]\ngrid = 16\ndt = 0.1\n[[force]]\nkind = 'point'\npoint = [0.5, 0.5]\n"
    head += "direction = [3, 1]\n[output]\nfps = 10\nsize = 24\n[time]\n"
    render(device, head, picture, tmp_path / "plain.%d.png")
    render(device, head + "dissolve = 0.3", picture, tmp_path / "loop.%d.png")
    render(device, head + "dissolve = 0.3", picture, tmp_path / "part.%d.png", part=(3, 4))
    plain = [read_picture(tmp_path / f"plain.{number}.png").pixels for number in range(9)]
    loop = [read_picture(tmp_path / f"loop.{number}.png").pixels for number in range(5)]
    assert not (tmp_path / "loop.5.png").exists()
    assert all(map(np.array_equal, loop[:3], plain[3:6]))
    for number, (end, beginning, share) in {3: (6, 1, 1 / 3), 4: (7, 2, 2 / 3)}.items():
        light = (1 - share) * to_bits(plain[end], 32) + share * to_bits(plain[beginning], 32)
        assert np.abs(to_bits(light, 8, dither=False).astype(int) - loop[number]).max() <= 1
        assert np.array_equal(read_picture(tmp_path / f"part.{number}.png").pixels, loop[number])


def test_a_video_has_the_quality_of_its_recipe(device: Device, picture: Path, tmp_path: Path):
    recipe = "duration = 0.1\n[fluid]\ngrid = 16\n[output]\nquality = {}\n"
    for quality, crf in ((50, 30), (90, 18)):
        render(device, recipe.format(quality), picture, tmp_path / "a.mp4")
        assert f"crf={crf}.0".encode() in (tmp_path / "a.mp4").read_bytes()


def test_frames_are_kept_where_that_is_asked_for_only(device: Device, picture: Path, tmp_path: Path):
    for number in (1, 2):
        write_map(tmp_path / f"m.{number}.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    order = applied(tmp_path / "m.%d.npy", picture, tmp_path / "f.%d.png")
    for resume, made in ((False, 2), (False, 2), (True, 0)):
        order = replace(order, outputs=replace(order.outputs, resume=resume))
        progress = Progress()
        assert order.perform(lambda: device, progress).frames == made
        assert progress.done == progress.total == made


@pytest.mark.parametrize("part", [(0, None), (2, 5), (8, None), (0, 0)])
def test_of_a_part_as_many_frames_are_promised_as_are_made(
    device: Device, clip: Path, tmp_path: Path, part: tuple[int, int | None]
) -> None:
    """And each is counted as often as its format goes through it."""
    write_map(tmp_path / "m.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    made = (9 if part[1] is None else part[1] + 1) - part[0]
    for name, passes in (("f.%d.png", 1), ("f.gif", 2)):
        order, progress = applied(tmp_path / "m.npy", clip, tmp_path / name), Progress()
        order = replace(order, outputs=replace(order.outputs, part=part))
        assert order.perform(lambda: device, progress).frames == made
        assert progress.done == progress.total == made * passes


def test_a_map_for_every_frame(device: Device, picture: Path, tmp_path: Path):
    """The picture through map k is frame k; converted, they are the same maps."""
    render(device, WHIRL, picture, tmp_path / "f.%03d.png", maps=MapOutput(tmp_path / "m.%03d.exr", overscan=3))
    assert len(files(tmp_path, "f.")) == len(files(tmp_path, "m.")) == 5
    apply(device, tmp_path / "m.%03d.exr", picture, tmp_path / "g.%03d.png", fps=10)
    for number in range(5):
        frame, again = (read_picture(tmp_path / f"{name}.{number:03d}.png").pixels.astype(int) for name in "fg")
        assert np.abs(frame - again).max() <= 1
    converted(MapSource(tmp_path / "m.%03d.exr"), tmp_path / "n.%02d.flo", "st", False, Progress())
    first, second = read_map(tmp_path / "m.004.exr"), read_map(tmp_path / "n.04.flo")
    assert first.overscan == 3
    assert np.abs(cropped(first).values - second.values).max() < 1e-6


@pytest.mark.parametrize("premultiplied", [False, True])
def test_a_soft_alpha_through_a_map_is_what_was_rendered(device: Device, tmp_path: Path, premultiplied: bool):
    pixels = np.random.default_rng(5).uniform(0, 1, (HEIGHT, WIDTH, 4))
    if premultiplied:
        pixels[..., :3] *= pixels[..., 3:]
    write_picture(tmp_path / "a.tif", Picture(np.round(pixels * 65535).astype(np.uint16), premultiplied=premultiplied))
    render(device, WHIRL, tmp_path / "a.tif", tmp_path / "b.tif", maps=MapOutput(tmp_path / "m.npy"))
    apply(device, tmp_path / "m.npy", tmp_path / "a.tif", tmp_path / "c.tif")
    rendered, applied = (read_picture(tmp_path / name) for name in ("b.tif", "c.tif"))
    assert rendered.premultiplied == applied.premultiplied == premultiplied
    np.testing.assert_allclose(applied.pixels.astype(int), rendered.pixels.astype(int), atol=65)


@pytest.mark.parametrize("size", [48, 300])
def test_a_map_at_any_size_with_overscan(device: Device, picture: Path, tmp_path: Path, size: int):
    """Inside it is the map without overscan; beyond the edge it goes on as on the edge."""
    for name, overscan in (("plain.npy", 0), ("more.exr", 7)):
        render(device, WHIRL, picture, None, maps=MapOutput(tmp_path / name, overscan=overscan, size=size))
    plain, more = read_map(tmp_path / "plain.npy"), read_map(tmp_path / "more.exr")
    assert (more.width, more.height, more.overscan) == (size, size * HEIGHT // WIDTH, 7)
    assert np.abs(cropped(more).values - plain.values).max() < 2e-6
    assert np.abs(more.values[:, 0] - more.values[:, 6]).max() < 1e-6


def test_forward_after_inverse_is_nothing(device: Device, picture: Path, tmp_path: Path):
    """Within a hundredth of a pixel in the mean: where a point goes, it is looked up from where it was."""
    for name, forward in (("back.exr", False), ("forth.exr", True)):
        render(device, WHIRL, picture, None, maps=MapOutput(tmp_path / name, forward=forward, size=384))
    back, forth = read_map(tmp_path / "back.exr"), read_map(tmp_path / "forth.exr")
    assert (back.forward, forth.forward) == (False, True)
    assert misfit(back, forth) < 0.01
    assert misfit(back, inverted(device, back)) < 0.05
    again = inverted(device, forth)
    assert not again.forward
    assert np.abs(again.values - back.values)[20:-20, 20:-20].max() * 384 < 0.1


def misfit(back: Displacement, forth: Displacement) -> float:
    """Mean of |F(y) + D(y + F(y))| in pixels, away from the border, D between its pixels by OpenCV."""
    y, x = np.mgrid[0 : forth.height, 0 : forth.width].astype(np.float32)
    at_x, at_y = (c + forth.longest * forth.values[..., axis] for axis, c in enumerate((x, y)))
    looked_up = cv2.remap(back.values.astype(np.float32), at_x.astype("f4"), at_y.astype("f4"), cv2.INTER_LINEAR)
    return float(np.hypot(*np.moveaxis(looked_up + forth.values, -1, 0))[8:-8, 8:-8].mean() * forth.longest)


def test_opencv_warps_by_the_map_as_we_do(device: Device, picture: Path, tmp_path: Path):
    render(device, WHIRL, picture, tmp_path / "ours.png", maps=MapOutput(tmp_path / "m.exr"))
    st = to_st(read_map(tmp_path / "m.exr"))
    x, y = st[..., 0] * WIDTH - 0.5, (1 - st[..., 1]) * HEIGHT - 0.5
    theirs = cv2.remap(scene(), x.astype("f4"), y.astype("f4"), cv2.INTER_CUBIC)
    ours = read_picture(tmp_path / "ours.png").pixels.astype(int)
    assert np.abs(ours - theirs)[4:-4, 4:-4].max() <= 2


def test_a_map_as_large_as_too_large_a_picture_is_refused_before_the_work(tmp_path: Path):
    """And the window, which has no options, names none."""
    pixels = np.broadcast_to(np.uint8(0), (24_000, 24_000, 1))
    job = Job(Recipe.parse(WHIRL), Picture(pixels), tmp_path, Outputs(None, maps=MapOutput(tmp_path / "m.exr")))
    with pytest.raises(UserError) as refused:
        job.check()
    large = "a map of 24000 x 24000 pixels"
    assert str(refused.value) == f"the size of the result makes {large}; ask for fewer by --map-size"
    assert refused.value.in_window == f"{large} is too large; choose a smaller size"


def test_the_size_of_the_gpu_does_not_bound_a_map(device: Device, picture: Path):
    """Found in pieces, it is the same."""
    replay = replayed(device, WHIRL, picture, 12)
    whole = displacement(replay, (WIDTH, HEIGHT)).values
    pieces = displacement(replay, (WIDTH, HEIGHT), overscan=1).values[1:-1, 1:-1]
    replay.release()
    assert np.abs(whole - pieces).max() < 1e-7


def test_a_map_that_is_found_in_pieces_can_be_given_up_before_each(
    device: Device, picture: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(export, "POINTS_AT_ONCE", 4 * (WIDTH + 2))
    replay, asked = replayed(device, WHIRL, picture, 1), list[int]()

    def check() -> None:
        asked.append(1)
        if len(asked) == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        displacement(replay, (WIDTH, HEIGHT), overscan=1, check=check)
    replay.release()


def test_a_recipe_begins_with_a_map(device: Device, picture: Path, tmp_path: Path):
    """Nothing flows: the end is the map's own warp. And what flows then, flows on from there."""
    render(device, WHIRL, picture, tmp_path / "one.png", maps=MapOutput(tmp_path / "start.exr"))
    still = 'map = "start.exr"\nduration = 0.1\nedges = "clamp"\n[fluid]\ngrid = 48\n'
    render(device, still, picture, tmp_path / "two.png")
    one, two = (read_picture(tmp_path / name).pixels.astype(int) for name in ("one.png", "two.png"))
    assert np.abs(one - two).max() <= 2
    assert np.abs(one - scene()).max() > 50
    render(device, f'map = "start.exr"\n{WHIRL}', picture, tmp_path / "three.png")
    assert np.abs(read_picture(tmp_path / "three.png").pixels.astype(int) - two).max() > 20
    assert Recipe.parse(Recipe.parse(still).text()) == Recipe.parse(still)


# How far it is ------------------------------------------------------------------------------------------------------


class Heard:
    """What a job says of how far it is: (done, total) after every step, and the states in between."""

    def __init__(self) -> None:
        self.steps: list[tuple[int, int | None]] = []
        self.states: list[str] = []
        self.progress = Progress(None, lambda done, total: self.steps.append((done, total)), tell=self.states.append)

    def check(self) -> None:
        """It never goes back, has a total, and ends with it."""
        done = [done for done, _ in self.steps]
        assert done == sorted(done)
        assert done[-1] == self.steps[-1][1]


def test_a_large_still_says_how_far_it_is(
    device: Device, picture: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Band by band while it is looked up, and that it is being written; by a recipe and by a map."""
    monkeypatch.setattr("app.work.export.Sampler", partial(Sampler, whole=2_000, tile=(640, 128)))
    monkeypatch.setattr("app.work.map_sampler.Sampler", partial(Sampler, whole=2_000, tile=(640, 128)))
    maps = MapOutput(tmp_path / "m.exr", size=96)
    job = Job(
        Recipe.parse(WHIRL + "size = 1500"), read_picture(picture), tmp_path, Outputs(tmp_path / "out.png", maps=maps)
    )
    heard = Heard()
    run(device, job, heard.progress)
    heard.check()
    bands = [done for done, _ in heard.steps if 20 < done <= 35]  # 1.5 million pixels after 20 steps
    assert len(bands) == 8
    assert heard.steps[-1] == (20 + 2 * 15 + 2, 20 + 2 * 15 + 2)
    assert heard.states == ["writing", "making the map", "writing the map"]
    again = Heard()
    applied(tmp_path / "m.exr", picture, tmp_path / "again.png", size=1500).perform(lambda: device, again.progress)
    again.check()
    assert [done for done, _ in again.steps] == [0, 1, 3, 5, 7, 9, 11, 13, 15, 30]
    assert again.states == ["reading", "", "writing"]


@pytest.mark.parametrize(("name", "passes"), [("out.mp4", 1), ("out.gif", 2), ("out.%02d.png", 1)])
def test_an_animation_says_how_far_it_is(
    device: Device, picture: Path, clip: Path, tmp_path: Path, name: str, passes: int
):
    """Also in the pass over all frames that a GIF takes after the last of them; a part, and a simulation that stops."""
    stop = "[stop]\ndisplacement_above = 0.02\n"
    for recipe, part, steps in (
        (WHIRL, (0, None), 20 + 5 * passes),
        (WHIRL, (1, 2), 10 + 2 * passes),  # a frame every 5 ticks
        (WHIRL + stop, (0, None), None),
    ):
        heard = Heard()
        job = Job(Recipe.parse(recipe), read_picture(picture), tmp_path, Outputs(tmp_path / name, part=part))
        report = run(device, job, heard.progress)
        heard.check()
        assert heard.steps[-1][0] == (steps or 2 * report.ticks + report.frames * passes)
        assert report.ticks == 20 or steps is None
        assert heard.states == ["writing"]
    write_map(tmp_path / "m.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    again = Heard()
    applied(tmp_path / "m.npy", clip, tmp_path / name).perform(lambda: device, again.progress)
    again.check()
    assert again.steps[-1][0] == 9 * passes


# What cannot be -----------------------------------------------------------------------------------------------------


def test_what_cannot_be_written(device: Device, clip: Path, picture: Path, tmp_path: Path):
    before = files(tmp_path, "")
    sequence = MapOutput(tmp_path / "m.%02d.exr")
    with pytest.raises(UserError, match=r"numbers the maps of an animation and .*out\.png is a picture"):
        render(device, WHIRL, picture, tmp_path / "out.png", maps=sequence)
    with pytest.raises(UserError, match="--frames is for an animation"):
        render(device, WHIRL, picture, tmp_path / "out.png", part=(1, 2))
    with pytest.raises(UserError, match=r"clip\.mkv is a clip"):
        render(device, 'mode = "density"\n' + WHIRL, clip, tmp_path / "out.mp4")
    loop = WHIRL + "[time]\ndissolve = 0.1\n"
    with pytest.raises(UserError, match=r"'time.dissolve' is for a picture, and .*clip\.mkv is a clip"):
        render(device, loop, clip, tmp_path / "out.mp4")
    with pytest.raises(UserError, match=r"a map cannot show a dissolve; leave out .*m\.%02d\.exr, or 'time.dissolve'"):
        render(device, loop, picture, tmp_path / "out.mp4", maps=sequence)
    write_map(tmp_path / "m.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    write_map(tmp_path / "m.001.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    with pytest.raises(UserError, match="several maps do not make a still"):
        apply(device, tmp_path / "m.%03d.npy", picture, tmp_path / "out.png")
    (tmp_path / "m.001.npy").unlink()
    with pytest.raises(UserError, match="do not make an animation"):
        apply(device, tmp_path / "m.npy", picture, tmp_path / "out.gif")
    with pytest.raises(UserError, match="there is no such file"):
        apply(device, tmp_path / "n.%03d.exr", picture, tmp_path / "out.gif")
    write_map(tmp_path / "m.npy", Displacement(np.zeros((64, 64, 2), np.float32)))
    with pytest.raises(UserError, match=r"m\.npy: .* must have the same proportions"):
        apply(device, tmp_path / "m.npy", picture, tmp_path / "out.png")
    with pytest.raises(UserError, match=r"m\.npy: .* must have the same proportions"):
        render(device, 'map = "m.npy"\n' + WHIRL, picture, tmp_path / "out.png")
    with pytest.raises(UserError, match="'map' warps coordinates"):
        Recipe.parse('map = "m.npy"\nmode = "density"')
    with pytest.raises(UserError, match=r"m\.npy would be replaced by its own result"):
        converted(MapSource(tmp_path / "m.npy"), tmp_path / "m.npy", "st", False, Progress())
    (tmp_path / "m.npy").rename(tmp_path / "m.02.npy")
    for pattern in ("m.%02d.npy", "m.##.npy"):  # two names of the same files
        maps = MapSource(tmp_path / pattern)
        with pytest.raises(UserError, match=f"{re.escape(pattern)} would be replaced by its own result"):
            converted(maps, tmp_path / "m.%02d.npy", "st", False, Progress())
    assert takes_place("/a/f.%03d.png", "/a/f.012.png")
    assert takes_place("/a/f.%d.png", "/a/f.12.png")
    for output, source in (("f.###.png", "f.012.png"), ("f.012.png", "f.###.png"), ("f.%03d.png", "f.###.png")):
        assert takes_place(f"/a/{output}", f"/a/{source}")
    for other in ("/a/f.12.png", "/a/f.0012.png", "/a/f.png", "/b/f.012.png", "/a/f.012.jpg"):
        assert not takes_place("/a/f.%03d.png", other)
    (tmp_path / "m.02.npy").unlink()
    assert files(tmp_path, "") == before


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_a_map_that_reaches_beyond_an_opaque_picture_gives_it_alpha(device: Device, dtype: type):
    top = 1 if dtype is np.float32 else np.iinfo(dtype).max
    pixels = np.full((30, 40, 3), top, dtype)
    values = np.zeros((30, 40, 2), np.float32)
    values[..., 0] = 0.25  # of the longer side: the right quarter comes from beyond
    given, how = GivenMap(device, values), Sampling(edges="transparent")
    found = looked_up(Sampler(device), given, pixels, Target((40, 30), how, lambda _: None, alpha=True))
    assert found.shape == (30, 40, 4)
    assert (found[:, :29, 3] == top).all()
    assert (found[:, 31:, 3] == 0).all()


def test_what_is_opaque_stays_so(device: Device, tmp_path: Path):
    """To the last bit of a float, whatever is mixed; and what is transparent anywhere gets an alpha channel."""
    light = Picture(scene().astype(np.float32) / 255)
    write_picture(tmp_path / "light.exr", light)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    clear = np.where((x - 48) ** 2 + (y - 32) ** 2 < 100, 0.25, 1).astype(np.float32)
    write_picture(tmp_path / "hole.exr", Picture(np.dstack([light.pixels, clear])))
    for size in (96, 47, 150):
        bounded = WHIRL.replace('edges = "clamp"', 'edges = "transparent"') + f"size = {size}\n"
        render(device, bounded, tmp_path / "light.exr", tmp_path / "out.exr")
        assert not read_picture(tmp_path / "out.exr").has_alpha
        render(device, bounded, tmp_path / "hole.exr", tmp_path / "out.exr")
        alpha = read_picture(tmp_path / "out.exr").pixels[..., 3]
        assert alpha.min() < 0.3
        assert (alpha == 1).mean() > 0.85
        assert not ((alpha > 1 - 1e-5) & (alpha < 1)).any()
    outward = np.zeros((HEIGHT, WIDTH, 2), np.float32)
    outward[..., 0] = 0.2
    write_map(tmp_path / "out.npy", Displacement(outward))
    light = applied(tmp_path / "out.npy", tmp_path / "light.exr", tmp_path / "out.exr", edges="transparent")
    light.perform(lambda: device, Progress())
    assert (read_picture(tmp_path / "out.exr").pixels[:, -10:, 3] == 0).all()


def test_several_threads_write_sequences_alone_and_no_more_than_fits_in_memory(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 16)
    assert writers_for(Path("a.mp4"), (640, 480)) == 1
    assert writers_for(Path("a.%04d.png"), (640, 480)) == 4
    assert writers_for(Path("a.%04d.png"), (6000, 4000)) == 2
    assert writers_for(Path("a.%04d.png"), (12_000, 9_000)) == 1
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    assert writers_for(Path("a.%04d.png"), (640, 480)) == 2


def test_one_place_a_pixel_is_as_sharp_as_a_spline(device: Device, tmp_path: Path) -> None:
    """`output.samples = 1` on a picture of fine grain: gradient energy beside the interpolating spline's."""
    rng = np.random.default_rng(4)
    grain = np.asarray(ndimage.gaussian_filter(rng.standard_normal((120, 160)), 1.0))
    source = Picture(np.round(127 + 40 * grain / grain.std()).clip(0, 255).astype(np.uint8)[..., None])
    write_picture(tmp_path / "grain.png", source)
    energy = {}
    for samples in ('"auto"', "1"):
        render(device, f"{WHIRL}samples = {samples}", tmp_path / "grain.png", tmp_path / "out.png")
        energy[samples] = sharpness(srgb_to_linear(read_picture(tmp_path / "out.png").pixels[..., 0] / 255))
    replay = Replay(device, Recipe.parse(WHIRL), Pictures(source), budget=0)
    replay.seek(20)
    reference = spline_warp(srgb_to_linear(source.pixels[..., 0] / 255), displacement(replay, (160, 120)).values)
    replay.release()
    assert energy['"auto"'] < 0.95 * energy["1"]
    assert energy["1"] == pytest.approx(sharpness(reference), rel=0.05)


def test_a_map_that_cannot_be_looked_up_or_inverted_is_named(device: Device, tmp_path: Path) -> None:
    picture = tmp_path / "in.png"
    write_picture(picture, Picture(scene()))
    write_map(tmp_path / "tiny.exr", Displacement(np.zeros((4, WIDTH * 4 // HEIGHT, 2), np.float32)))
    with pytest.raises(UserError, match=r"Cannot use .*/tiny\.exr: it is 6 x 4 pixels, and a side must .* 6; make"):
        apply(device, tmp_path / "tiny.exr", picture, tmp_path / "out.png")
    holes = np.zeros((HEIGHT, WIDTH, 2), np.float32)
    holes[3, 4] = np.nan
    write_map(tmp_path / "holes.exr", Displacement(holes, forward=True))
    said = r"Cannot use .*/holes\.exr: it is NaN in places, and cannot be inverted; fill it first\."
    with pytest.raises(UserError, match=said):
        apply(device, tmp_path / "holes.exr", picture, tmp_path / "out.png")
    with pytest.raises(UserError, match=said):
        converted(MapSource(tmp_path / "holes.exr"), tmp_path / "out.exr", "st", True, Progress())
    assert not list(tmp_path.glob("out.*"))


def test_a_map_that_tears_a_large_picture_is_told(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Ours does not: but a recipe may begin with one from elsewhere."""
    torn = np.zeros((HEIGHT, WIDTH, 2), np.float32)
    torn[::2], torn[1::2] = -0.4, 0.4
    np.save(tmp_path / "torn.npy", torn)
    monkeypatch.setattr("app.work.export.Sampler", partial(Sampler, whole=2_000, tile=(48, 32)))
    job = Job(Recipe.parse(f'map = "torn.npy"\n{WHIRL}'), Picture(scene()), tmp_path, Outputs(tmp_path / "x.png"))
    with pytest.raises(UserError, match=r"^torn\.npy cannot be applied: the map tears a patch"):
        run(device, job, Progress())
    assert not (tmp_path / "x.png").exists()


@pytest.mark.parametrize("name", ["out.png", "out.mp4", "out.gif", "map.exr", "stats.json", "f.%02d.png"])
def test_a_file_that_another_program_writes_meanwhile_is_not_replaced_without_a_word(
    device: Device, picture: Path, tmp_path: Path, name: str
):
    """Two tasks of a farm for one file, or a person who works on while it is exported."""
    file = tmp_path / name
    if name == "stats.json":
        outputs = Outputs(tmp_path / "out.png", stats=file)
    elif name == "map.exr":
        outputs = Outputs(tmp_path / "out.png", maps=MapOutput(file))
    else:
        outputs = Outputs(file)
    file.write_text("from before")

    def said(meanwhile: Callable[[], object]) -> list[str]:
        def report(done: int, total: int | None) -> None:
            if done == 1:
                meanwhile()

        job = Job(Recipe.parse(WHIRL), open_source(picture).picture, tmp_path, outputs)
        told = run(device, job, Progress(report=report)).notices
        assert not is_sequence(name) or (tmp_path / "f.00.png").is_file()
        return [line for line in told if "another program" in line]

    assert said(lambda: None) == []
    line = f"{name}: another program wrote this file while it was being made; what that wrote is replaced"
    assert said(lambda: file.write_text("of another")) == ([] if is_sequence(name) else [line])
    assert is_sequence(name) or file.read_bytes() != b"of another"


def test_a_still_of_a_clip_s_frame_is_that_file_of_the_sequence(device: Device, tmp_path: Path) -> None:
    """Also where the recipe looks at other frames; once the fluid has come to its end all frames have the same warp."""
    for number in range(5, 10):
        pixels = scene(number)
        pixels[:, 10 * number - 40 : 10 * number - 20] = 255
        write_picture(tmp_path / f"f.{number}.png", Picture(pixels))
    looks = '[[mask]]\nkind = "picture"\nof = "frozen"\npicture = "source"\ntick = 0\nframe = 3\nwhite = 0.9\n'
    recipe = Recipe.parse(WHIRL.replace("duration = 0.4", "duration = 0.2") + looks)
    source = open_source(tmp_path / "f.%d.png")
    assert source.clip is not None
    moving = Job(recipe, source.picture, tmp_path, Outputs(tmp_path / "w.%d.png"), clip=source.clip)
    run(device, moving, Progress())
    others = set[bytes]()
    for number in (8, 9):
        outputs = Outputs(tmp_path / "still.png")
        run(device, Job(recipe, source.picture, tmp_path, outputs, frame=(source.clip, number)), Progress())
        found, wanted = (read_picture(tmp_path / name).pixels for name in ("still.png", f"w.{number}.png"))
        assert np.array_equal(found, wanted)
        others.add(found.tobytes())
    assert len(others) == 2


@pytest.mark.parametrize(("dt", "solver"), [(1 / 60, "paper"), (0.0625, "mac")])
def test_the_numbers_tell_what_they_are_of(
    device: Device, picture: Path, tmp_path: Path, dt: float, solver: str
) -> None:
    """As exactly as the recipe says it: times are found again by them."""
    recipe = Recipe.parse(WHIRL).edited(duration=4 * dt)
    recipe = recipe.edited(fluid=recipe.fluid.model_copy(update={"dt": dt, "solver": solver, "grid": 32}))
    outputs = Outputs(tmp_path / "a.png", stats=tmp_path / "a.json")
    run(device, Job(recipe, open_source(picture).picture, tmp_path, outputs), Progress())
    told = json.loads((tmp_path / "a.json").read_text("utf-8"))
    frames = told.pop("frames")
    assert told == {
        "fluidwarp": 1,
        "opengl": device.limits.renderer,
        "picture": [WIDTH, HEIGHT],
        "result": [WIDTH, HEIGHT],
        "grid": [32, round(32 * HEIGHT / WIDTH)],
        "dt": dt,
        "solver": solver,
        "stopped": None,
    }
    assert [(frame["frame"], frame["tick"], frame["time"]) for frame in frames] == [(0, 4.0, 4 * dt)]
