"""Sequences of pictures as a pipeline has them: numbers kept, what is missing named, what is whole not made again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from app.errors import UserError
from app.media.animation import animation_writer
from app.media.displacement import Displacement
from app.media.maps import write_map
from app.media.pictures import read_picture, write_picture
from app.media.record import Record
from app.media.source import open_source
from app.model.picture import Picture
from support.commands import Run

ROOT = Path(__file__).parents[2]
WIDTH, HEIGHT = 48, 32
RECIPE = """
duration = 0.3
edges = "clamp"
[fluid]
grid = 32
dt = 0.02
[[force]]
kind = "vortex"
point = [0.45, 0.5]
radius = 0.3
strength = 6
[output]
fps = 10
"""


def plate(number: int) -> np.ndarray:
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    return np.stack([x / WIDTH, y / HEIGHT, np.full_like(x, number / 10, float)], axis=-1).astype(np.float32)


def write_exr(path: Path, number: int) -> None:
    header = {"type": OpenEXR.scanlineimage, "shot": f"frame {number}"}
    depth = np.full((HEIGHT, WIDTH), number, np.float32)
    OpenEXR.File(header, {"RGB": plate(number), "Z": depth}).write(str(path))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "a.toml").write_text(RECIPE)
    for number in range(1001, 1005):
        write_exr(tmp_path / f"plate.{number:04d}.exr", number - 1000)
    return tmp_path


def made(folder: Path, start: str = "w.") -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.name.startswith(start))


def channels(path: Path) -> dict[str, np.ndarray]:
    return {
        name: channel.pixels for name, channel in OpenEXR.File(str(path), separate_channels=True).channels().items()
    }


@pytest.mark.parametrize("name", ["plate.%04d.exr", "plate.####.exr"])
def test_each_file_is_warped_by_the_state_of_its_frame(folder: Path, fluidwarp: Run, name: str):
    """As the same picture is, alone, by the map of that frame; with its own layers and attributes, under its number."""
    ran = fluidwarp(folder, "render", "a.toml", name, "-o", "w.%04d.exr", "--map", "m.%04d.exr")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert made(folder) == [f"w.{number}.exr" for number in range(1001, 1005)]
    for number in (1001, 1002, 1004):
        ran = fluidwarp(folder, "apply", f"m.{number}.exr", f"plate.{number}.exr", "-o", "one.exr", "--edges", "clamp")
        assert ran.returncode == 0, ran.stderr
        one, warped = channels(folder / "one.exr"), channels(folder / f"w.{number}.exr")
        assert sorted(warped) == ["B", "G", "R", "Z"]
        for channel, values in warped.items():
            np.testing.assert_allclose(values, one[channel], atol=2e-3)
        assert (
            OpenEXR.File(str(folder / f"w.{number}.exr"), header_only=True).header()["shot"] == f"frame {number - 1000}"
        )
    np.testing.assert_allclose(channels(folder / "w.1001.exr")["R"], plate(1)[..., 0], atol=1e-6)  # W_0 is nothing
    assert np.abs(channels(folder / "w.1004.exr")["R"] - plate(4)[..., 0]).max() > 0.05


def test_a_range_has_the_same_frames_as_the_whole(folder: Path, fluidwarp: Run):
    for words in (["-o", "whole.%05d.png"], ["-o", "part.#####.png", "--frames", "1002-1003"]):
        ran = fluidwarp(folder, "render", "a.toml", "plate.%04d.exr", *words, "--bits", "16")
        assert ran.returncode == 0, ran.stderr
    assert made(folder, "part.") == ["part.01002.png", "part.01003.png"]
    for number in (1002, 1003):
        whole, part = (folder / f"{name}.{number:05d}.png" for name in ("whole", "part"))
        assert whole.read_bytes() == part.read_bytes()


@pytest.mark.parametrize(
    ("remove", "words", "told"),
    [
        ((1002,), [], "of 1001-1004 it lacks the frame 1002; make them, or give --frames"),
        ((), ["--frames", "990-1010"], "of 990-1010 it lacks the frames 990-1000, 1005-1010;"),
        ((), ["--frames", "2000-"], "it has the frames 1001-1004, and none from 2000 on"),
        ((1001, 1002, 1003, 1004), [], "there is no such file"),
    ],
)
@pytest.mark.parametrize("command", ["render", "apply"])
def test_missing_frames_are_named(
    folder: Path, fluidwarp: Run, command: str, remove: tuple[int, ...], words: list[str], told: str
):
    write_map(folder / "m.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    for number in remove:
        (folder / f"plate.{number}.exr").unlink()
    by = "a.toml" if command == "render" else "m.npy"
    ran = fluidwarp(folder, command, by, "plate.%04d.exr", "-o", "w.%04d.exr", *words)
    assert ran.returncode == 1
    assert told in ran.stderr
    assert ran.stderr.count("\n") == 1
    assert made(folder) == []


def test_frames_of_another_kind_are_told(folder: Path, fluidwarp: Run):
    write_picture(folder / "plate.1003.exr", Picture(np.zeros((HEIGHT, WIDTH + 1, 3), np.float32)))
    ran = fluidwarp(folder, "render", "a.toml", "plate.%04d.exr", "-o", "w.%04d.exr")
    assert ran.returncode == 1
    assert "plate.1003.exr: it has 49 x 32 pixels of 3 x 32 bits, and the first of its sequence 48 x 32" in ran.stderr
    assert made(folder) == ["w.1001.exr", "w.1002.exr"]


def test_files_are_not_replaced_by_their_own_results(folder: Path, fluidwarp: Run):
    for name in ("plate.%04d.exr", "plate.####.exr", "plate.1002.exr"):
        ran = fluidwarp(folder, "render", "a.toml", "plate.####.exr", "-o", name)
        assert ran.returncode == 1
        assert "would be replaced by its own result" in ran.stderr


@pytest.mark.parametrize("option", ["--map", "--stats"])
def test_a_frame_is_not_replaced_by_what_else_is_asked_for(folder: Path, fluidwarp: Run, option: str) -> None:
    ran = fluidwarp(folder, "render", "a.toml", "plate.####.exr", "-o", "w.####.exr", option, "w.1002.exr")
    assert ran.returncode == 1
    assert "w.1002.exr cannot hold two results" in ran.stderr
    assert made(folder) == []


# --resume -----------------------------------------------------------------------------------------------------------


def inodes(folder: Path) -> dict[str, int]:
    return {name: (folder / name).stat().st_ino for name in made(folder)}


def test_what_is_whole_is_not_made_again(folder: Path, fluidwarp: Run):
    """But what is cut, gone, of another source, recipe, depth or option is."""
    words = ["plate.%04d.exr", "-o", "w.%04d.exr", "--resume"]
    assert fluidwarp(folder, "render", "a.toml", *words[:-1]).returncode == 0
    first, before = {name: (folder / name).read_bytes() for name in made(folder)}, inodes(folder)

    ran = fluidwarp(folder, "render", "a.toml", *words)
    assert (ran.returncode, ran.stderr) == (0, "fluidwarp: 4 of 4 frames were whole and are kept\n")
    assert inodes(folder) == before

    (folder / "w.1002.exr").write_bytes(first["w.1002.exr"][:-1])
    (folder / "w.1003.exr").unlink()
    write_exr(folder / "plate.1004.exr", 9)
    ran = fluidwarp(folder, "render", "a.toml", *words)
    assert (ran.returncode, ran.stderr) == (0, "fluidwarp: 1 of 4 frames were whole and are kept\n")
    assert inodes(folder)["w.1001.exr"] == before["w.1001.exr"]
    for name in ("w.1002.exr", "w.1003.exr"):
        assert (folder / name).read_bytes() == first[name]
    assert (folder / "w.1004.exr").read_bytes() != first["w.1004.exr"]

    for change in (["--bits", "16"], ["--bits", "16", "--size", "40"], ["--duration", "0.2"]):
        ran = fluidwarp(folder, "render", "a.toml", *words, *change)
        told = "fluidwarp: w.%04d.exr holds 16-bit floats and not the picture's 32-bit floats; "  # once
        assert (ran.returncode, ran.stderr) == (
            0,
            f"{told}write it with more bits to keep it\n" if "--bits" in change else "",
        )
    part = fluidwarp(folder, "render", "a.toml", *words, "--duration", "0.2", "--frames", "1002-1003")
    assert part.stderr == "fluidwarp: 2 of 2 frames were whole and are kept\n"


@pytest.mark.parametrize(
    "change",
    [
        ["--bits", "16"], ["--size", "40"], ["--filter", "bilinear"], ["--edges", "mirror"], ["--strip"],
        ["--codec", "zips"], ["--overscan", "0"],
    ],
    ids=lambda change: change[0],
)  # fmt: skip
def test_what_was_applied_otherwise_is_applied_again(folder: Path, fluidwarp: Run, change: list[str]):
    write_map(folder / "m.exr", Displacement(np.full((HEIGHT + 4, WIDTH + 4, 2), 0.02, np.float32), 2))
    words = ["apply", "m.exr", "plate.%04d.exr", "-o", "w.%04d.exr"]
    assert fluidwarp(folder, *words).returncode == 0
    first = {name: (folder / name).read_bytes() for name in made(folder)}
    kept = fluidwarp(folder, *words, "--resume")
    assert (kept.returncode, kept.stderr) == (0, "fluidwarp: 4 of 4 frames were whole and are kept\n")
    ran = fluidwarp(folder, *words, "--resume", *change)
    assert "kept" not in ran.stderr, ran.stderr
    if change == ["--overscan", "0"]:  # which the map's own number would not be
        assert (ran.returncode, "same proportions" in ran.stderr) == (1, True), ran.stderr
        return
    assert ran.returncode == 0
    assert all((folder / name).read_bytes() != data for name, data in first.items())


@pytest.mark.parametrize(
    ("command", "picture", "name", "ways"),
    [
        ("render a.toml", "plate.1001.exr", "w.%d.exr", ["--bits 16", "--strip", "--codec zips", "--amount 0.5"]),
        ("render a.toml", "p.png", "w.%d.jpg", ["--quality 20", "dense.png", "other.png"]),
        ("render a.toml", "p.png", "m.%d.exr", ["--offsets", "--forward", "--overscan 2", "--map-size 24"]),
        ("apply given.%d.exr", "p.png", "w.%d.jpg", ["--quality 20", "dense.png", "--kind offsets", "--grid corners"]),
    ],
    ids=["frames", "jpegs", "maps", "applied"],
)
def test_what_was_made_otherwise_is_made_again(
    folder: Path, fluidwarp: Run, command: str, picture: str, name: str, ways: list[str]
):
    """After each option that changes the files, they are as if there had been none; and with it again they are kept."""
    pixels = (plate(1) * 255).astype(np.uint8)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    places = np.stack([(x + 0.5) / WIDTH + 0.05, 1 - (y + 0.5) / HEIGHT, 0 * x], axis=-1).astype(np.float32)
    pictures = {
        "p.png": Picture(pixels), "dense.png": Picture(pixels, dpi=(300, 300)), "other.png": Picture(pixels[::-1]),
        "given.1.exr": Picture(places),
    }  # fmt: skip
    for place, given in pictures.items():
        write_picture(folder / place, given)
    (folder / "new").mkdir()
    file, other = (folder / place / name.replace("%d", "1") for place in (".", "new"))
    usual = [*command.split(), "--frames", "1", "-o" if name.startswith("w") else "--map"]
    for way in ways:
        words = [picture, *way.split()] if way.startswith("-") else [way]
        assert fluidwarp(folder, *usual, name, picture).returncode == 0
        first = file.read_bytes()
        said = [fluidwarp(folder, *usual, name, "--resume", *words).stderr for _ in range(2)]
        assert ["kept" in text for text in said] == [False, True], (way, said)
        assert fluidwarp(folder, *usual, f"new/{name}", *words).returncode == 0
        assert file.read_bytes() == other.read_bytes() != first, way


def test_a_mask_of_the_colours_of_a_frame_is_that_frame_s(folder: Path, fluidwarp: Run):
    """Of a still too, and of what was made before that frame was another; one that there is not is told."""
    mask = '[[mask]]\nkind = "fill"\ntick = 0\nof = "frozen"\namount = 1\nsegment = {color = "#ffffff", frame = 2}\n'
    (folder / "a.toml").write_text(RECIPE.replace("duration = 0.3", "duration = 0.1") + mask)
    first = ["render", "a.toml", "plate.%04d.exr", "-o", "w.%04d.exr", "--frames", "1002-1002", "--resume"]
    still = ["render", "a.toml", "plate.%04d.exr", "-o", "still.exr"]
    said = "mask[1]: the segmentation is empty; nothing in the picture is chosen by it"
    assert said in fluidwarp(folder, *first).stderr
    for white, words in ((slice(0, 24), first), (slice(24, 48), first), (slice(24, 48), still)):
        values = plate(3)
        values[:, white] = 1
        OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": values}).write(str(folder / "plate.1003.exr"))
        ran = fluidwarp(folder, *words)
        assert (ran.returncode, "kept" in ran.stderr) == (0, False)
        name, number = ("still.exr", 1) if words is still else ("w.1002.exr", 2)
        is_kept = channels(folder / name)["R"] == plate(number)[..., 0]
        assert is_kept[:, white].all()
        assert not is_kept.all()
    (folder / "plate.1003.exr").unlink()
    (folder / "plate.1004.exr").unlink()
    assert "has no frame 1003" in fluidwarp(folder, *still).stderr


def test_what_is_kept_says_nothing_of_handles_that_are_on_their_way(folder: Path, fluidwarp: Run):
    """Only as much is simulated as is missing; a handle that arrives by the last frame was told not to have begun."""
    handle = "[[handle]]\nat = [0.4, 0.5]\nto = [0.45, 0.5]\nduration = 0.2\n"
    (folder / "a.toml").write_text(f"duration = 0.4\n[fluid]\ngrid = 32\n[output]\nfps = 10\n{handle}")
    write_picture(folder / "p.png", Picture((plate(1) * 255).astype(np.uint8)))
    words = ["render", "a.toml", "p.png", "-o", "w.%02d.png", "--resume"]
    assert fluidwarp(folder, *words).stderr == ""
    for gone, kept in ((), 5), (("w.01.png",), 4):
        for name in gone:
            (folder / name).unlink()
        assert fluidwarp(folder, *words).stderr == f"fluidwarp: {kept} of 5 frames were whole and are kept\n"


def test_where_nothing_is_simulated_nothing_takes_long(folder: Path, fluidwarp: Run):
    """A grid far finer than the picture was told to take long also where all frames are kept."""
    force = "[[force]]\nkind = 'vortex'\npoint = [0.5, 0.5]\nradius = 0.3\nstrength = 5\n"
    (folder / "a.toml").write_text(f"duration = 0.02\n[fluid]\ngrid = 388\ndt = 0.02\n[output]\nfps = 50\n{force}")
    write_picture(folder / "p.png", Picture((plate(1) * 255).astype(np.uint8)))
    words = ["render", "a.toml", "p.png", "-o", "w.%02d.png", "--resume"]
    assert "times as fine as the picture" in fluidwarp(folder, *words).stderr
    assert fluidwarp(folder, *words).stderr == "fluidwarp: 2 of 2 frames were whole and are kept\n"
    (folder / "w.00.png").unlink()  # which is the picture itself
    assert fluidwarp(folder, *words).stderr == "fluidwarp: 1 of 2 frames were whole and are kept\n"


def test_a_damaged_record_costs_no_more_than_the_work(folder: Path, fluidwarp: Run):
    words = ["render", "a.toml", "plate.%04d.exr", "-o", "w.%04d.exr"]
    assert fluidwarp(folder, *words).returncode == 0
    (record,) = folder.glob(".fluidwarp-frames-*")
    lines = record.read_bytes().splitlines(keepends=True)
    record.write_bytes(b"\xff\xfe junk\n" + lines[0] + lines[1][:30] + b"\0" * 40)
    ran = fluidwarp(folder, *words, "--resume")
    assert ran.stderr == "fluidwarp: 1 of 4 frames were whole and are kept\n"
    assert fluidwarp(folder, *words, "--resume").stderr == "fluidwarp: 4 of 4 frames were whole and are kept\n"
    os.truncate(record, 300 * 2**20)
    line = f"fluidwarp: Cannot read {record.name}: it has more than 256 MB; remove it.\n"
    assert fluidwarp(folder, *words, "--resume").stderr == line


@pytest.mark.skipif(sys.platform == "win32", reason="links and pipes are made otherwise there")
@pytest.mark.parametrize("what", ["link", "link to nothing", "pipe", "folder"])
@pytest.mark.parametrize("more", [[], ["--resume"]], ids=" ".join)
def test_what_is_put_in_the_place_of_a_record_is_neither_followed_nor_waited_for(
    folder: Path, fluidwarp: Run, what: str, more: list[str]
):
    words = ["render", "a.toml", "plate.%04d.exr", "-o", "f.%04d.exr", *more]
    assert fluidwarp(folder, *words).returncode == 0
    (record,) = folder.glob(".fluidwarp-frames-*")
    record.unlink()
    for frame in folder.glob("f.*.exr"):
        frame.unlink()
    (folder / "precious.txt").write_text("of somebody")
    if what == "pipe":
        os.mkfifo(record)
    elif what == "folder":
        record.mkdir()
    else:
        record.symlink_to("precious.txt" if what == "link" else "nothing")
    before = sorted(path.name for path in folder.iterdir())
    ran = fluidwarp(folder, *words)
    told = "a link" if "link" in what else "no ordinary file"
    line = f"fluidwarp: Cannot write {record.name}: it is {told}; remove it, or write to another folder.\n"
    assert (ran.returncode, ran.stderr) == (1, line)
    assert sorted(path.name for path in folder.iterdir()) == before
    assert (folder / "precious.txt").read_text() == "of somebody"


def test_a_record_that_has_no_room_is_told_by_the_name_of_its_sequence(tmp_path: Path):
    """Nobody has heard of the hidden file beside the frames."""
    limits = pytest.importorskip("resource")
    record = Record(tmp_path / "f.%d.png", str)
    (tmp_path / "f.1.png").write_bytes(b"1")
    before = limits.getrlimit(limits.RLIMIT_FSIZE)
    try:
        limits.setrlimit(limits.RLIMIT_FSIZE, (40, before[1]))
        record.add(1, tmp_path / "f.1.png")  # of which a part is written
        with pytest.raises(UserError) as raised:
            record.add(1, tmp_path / "f.1.png")
    finally:
        limits.setrlimit(limits.RLIMIT_FSIZE, before)
    said = "the file grows larger than this disk allows; choose another folder or a smaller size"
    assert str(raised.value) == f"Cannot write {tmp_path / 'f.%d.png'}: {said}."


def test_a_record_that_becomes_a_link_while_frames_are_written_is_not_followed(tmp_path: Path):
    record = Record(tmp_path / "f.%d.png", str)
    (tmp_path / "f.1.png").write_bytes(b"1")
    record.add(1, tmp_path / "f.1.png")
    (path,) = tmp_path.glob(".fluidwarp-frames-*")
    path.rename(tmp_path / "precious")
    path.symlink_to("precious")
    before = (tmp_path / "precious").read_bytes()
    with pytest.raises(UserError, match=r"fluidwarp-frames-\w+: it is a link; remove it"):
        record.add(1, tmp_path / "f.1.png")
    assert (tmp_path / "precious").read_bytes() == before


def test_a_frame_that_another_task_replaces_at_once_is_not_taken_for_ones_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Two tasks of different recipes that write to the same names: the one's frame was noted as the other's."""
    records = [Record(tmp_path / "f.%d.png", f"{recipe} {{}}".format) for recipe in "ab"]
    replace = os.replace

    def write(task: int) -> None:
        pixels = np.full((8, 8, 3), task, np.uint8)
        with animation_writer(tmp_path / "f.%d.png", written=records[task].add) as frame:
            frame(pixels, 1)

    def replacing_at_once(source: Path, target: Path) -> None:
        replace(source, target)
        monkeypatch.setattr(os, "replace", replace)
        write(1)

    monkeypatch.setattr(os, "replace", replacing_at_once)
    write(0)
    assert read_picture(tmp_path / "f.1.png").pixels.max() == 1
    assert [record.holds(1) for record in records] == [False, True]


def test_a_file_that_has_become_longer_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    file = tmp_path / "f.1.png"
    file.write_bytes(b"1")
    record = Record(tmp_path / "f.%d.png", str)
    record.add(1, file)
    assert Record(tmp_path / "f.%d.png", str).holds(1)
    os.truncate(file, 2**40)
    monkeypatch.setattr("app.media.record.digest_of_file", lambda path: pytest.fail("it is read"))
    assert not Record(tmp_path / "f.%d.png", str).holds(1)


def test_a_picture_there_and_back_and_its_maps_go_on(folder: Path, fluidwarp: Run):
    """Frames that are shown twice, of one picture; and files of maps beside them, of which one is gone."""
    (folder / "a.toml").write_text(RECIPE + "[time]\nping_pong = true\n")
    write_picture(folder / "p.png", Picture((plate(1) * 255).astype(np.uint8)))
    words = ["render", "a.toml", "p.png", "-o", "w.%02d.png", "--resume"]
    assert fluidwarp(folder, *words).returncode == 0
    first = {name: (folder / name).read_bytes() for name in made(folder)}
    assert len(first) == 6
    for name in ("w.01.png", "w.04.png"):
        (folder / name).unlink()
    ran = fluidwarp(folder, *words)
    assert ran.stderr == "fluidwarp: 4 of 6 frames were whole and are kept\n"
    assert {name: (folder / name).read_bytes() for name in made(folder)} == first

    words += ["--map", "m.%02d.npy"]
    assert fluidwarp(folder, *words).stderr == ""
    (folder / "m.02.npy").unlink()
    assert fluidwarp(folder, *words).stderr == "fluidwarp: 5 of 6 frames were whole and are kept\n"
    assert len(made(folder, "m.")) == 6


def test_a_killed_task_keeps_its_frames(folder: Path, fluidwarp: Run):
    (folder / "a.toml").write_text(RECIPE.replace("duration = 0.3", "duration = 2000"))
    command = [sys.executable, "-m", "app", "render", "a.toml", "plate.1001.exr", "-o", "w.%03d.png"]
    job = subprocess.Popen(command, cwd=folder, env=os.environ | {"PYTHONPATH": str(ROOT)})
    asked = time.monotonic()
    while len(made(folder)) < 5:
        assert time.monotonic() < asked + 60
        assert job.poll() is None
        time.sleep(0.01)
    job.send_signal(signal.SIGKILL)
    job.wait()
    there = made(folder)
    for name in there:
        assert read_picture(folder / name).width == WIDTH
    ran = fluidwarp(folder, *command[3:], "--resume", "--frames", f"0-{len(there) + 1}")
    kept = int(ran.stderr.split()[1])
    assert kept >= len(there) - 1  # of the last one the line may be missing
    assert made(folder) == [f"w.{number:03d}.png" for number in range(len(there) + 2)]
    assert not list(folder.glob(".w*"))  # what was half written is swept


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["-o", "w.mp4"], "--resume needs a sequence, such as f.%04d.png, and w.mp4 is none; leave it out"),
        (["-o", "w.%04d.exr", "--stats", "s.json"], "--stats needs all frames"),
    ],
)
def test_what_cannot_be_resumed_is_told(folder: Path, fluidwarp: Run, words: list[str], told: str):
    ran = fluidwarp(folder, "render", "a.toml", "plate.%04d.exr", *words, "--resume")
    assert ran.returncode == 1
    assert told in ran.stderr


# Maps ---------------------------------------------------------------------------------------------------------------


def test_maps_and_frames_go_together_by_their_numbers(folder: Path, fluidwarp: Run):
    """A shift by as many pixels as the map's number says; maps that begin elsewhere go in order."""
    for first in (7, 1000):
        for number in range(first, first + 5):
            shift = np.zeros((HEIGHT, WIDTH, 2), np.float32)
            shift[..., 0] = (number - first) / WIDTH
            write_map(folder / f"m{first}.{number}.npy", Displacement(shift))
    for maps, shifts in (("m1000.%d.npy", (1, 2, 3, 4)), ("m7.%d.npy", (0, 1, 2, 3))):
        ran = fluidwarp(folder, "apply", maps, "plate.####.exr", "-o", "w.####.exr", "--edges", "clamp")
        assert (ran.returncode, ran.stderr) == (0, "")
        for number, shift in zip(range(1001, 1005), shifts, strict=True):
            expected = plate(number - 1000)[:, np.minimum(np.arange(WIDTH) + shift, WIDTH - 1), 0]
            np.testing.assert_allclose(channels(folder / f"w.{number}.exr")["R"], expected, atol=1e-6)
            assert (channels(folder / f"w.{number}.exr")["Z"] == number - 1000).all()
    ran = fluidwarp(folder, "apply", "m1000.%d.npy", "plate.1001.exr", "-o", "p.%d.png", "--frames", "1002-1003")
    assert (ran.returncode, made(folder, "p.")) == (0, ["p.1002.png", "p.1003.png"])
    (folder / "m1000.1002.npy").unlink()
    ran = fluidwarp(folder, "apply", "m1000.%d.npy", "plate.####.exr", "-o", "x.####.exr")
    assert "it lacks the frame 1002" in ran.stderr


def test_of_a_sequence_of_one_file_nothing_is_left_out(tmp_path: Path) -> None:
    for count in (1, 2):
        write_picture(tmp_path / f"a.{count}.png", Picture(np.zeros((4, 4, 3), np.uint8)))
        note = open_source(tmp_path / "a.%d.png", animated=False).picture.note
        assert ("only the first is used" in note) == (count > 1)


def test_apply_goes_on(folder: Path, fluidwarp: Run):
    write_map(folder / "m.npy", Displacement(np.full((HEIGHT, WIDTH, 2), 0.05, np.float32)))
    words = ["apply", "m.npy", "plate.%04d.exr", "-o", "w.%04d.exr"]
    assert fluidwarp(folder, *words).returncode == 0
    (folder / "w.1003.exr").unlink()
    before = inodes(folder)
    assert fluidwarp(folder, *words, "--resume").stderr == "fluidwarp: 3 of 4 frames were whole and are kept\n"
    assert len(made(folder)) == 4
    assert before.items() <= inodes(folder).items()
    write_exr(folder / "plate.1002.exr", 7)
    assert fluidwarp(folder, *words, "--resume").stderr == "fluidwarp: 3 of 4 frames were whole and are kept\n"
    assert (channels(folder / "w.1002.exr")["Z"] == 7).any()
    write_map(folder / "m.npy", Displacement(np.full((HEIGHT, WIDTH, 2), 0.06, np.float32)))
    assert fluidwarp(folder, *words, "--resume").stderr == ""


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_apply_takes_many(folder: Path, fluidwarp: Run, jobs: str):
    """Into a folder, in processes, each under its own name; a sequence as one of them; what fails is told in a line."""
    write_map(folder / "m.npy", Displacement(np.full((HEIGHT, WIDTH, 2), 0.05, np.float32)))
    write_picture(folder / "p.png", Picture((plate(1) * 255).astype(np.uint8)))
    given = ["p.png", "gone.png", "plate.%04d.exr"]
    ran = fluidwarp(folder, "apply", "m.npy", *given, "-o", "out", "--jobs", jobs)
    assert ran.returncode == 1
    assert "gone.png" in ran.stderr
    assert ran.stderr.endswith("fluidwarp: 1 of 3 pictures failed; all others are written\n")
    assert made(folder / "out", "p") == ["p.png", *(f"plate.{number}.exr" for number in range(1001, 1005))]
    ran = fluidwarp(folder, "apply", "m.npy", "plate.1001.exr", "plate.####.exr", "-o", "out")
    assert (ran.returncode, "would both become" in ran.stderr) == (1, True)


@pytest.mark.parametrize("edges", ["transparent", "clamp", "black"])
def test_nan_in_a_map_is_outside(folder: Path, fluidwarp: Run, edges: str):
    """Pixel for pixel, and what is beside it is as if the map went on there."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    values = np.stack([0.05 * np.sin(y / 5), 0.04 * np.cos(x / 6)], axis=-1).astype(np.float32)
    hole = (x - 20) ** 2 + (y - 15) ** 2 < 40
    write_map(folder / "whole.npy", Displacement(values))
    values[hole] = np.nan
    write_map(folder / "m.exr", Displacement(values))
    for name in ("whole.npy", "m.exr"):
        ran = fluidwarp(
            folder, "apply", name, "plate.1002.exr", "-o", f"w.{Path(name).stem}.exr", "--edges", edges, "--bits", "32"
        )
        assert (ran.returncode, ran.stderr) == (0, "")
    whole, seen = channels(folder / "w.whole.exr"), channels(folder / "w.m.exr")
    away = (x - 20) ** 2 + (y - 15) ** 2 > 80
    for channel in "RGB":
        assert (seen[channel][hole] == 0).all()
        np.testing.assert_allclose(seen[channel][away], whole[channel][away], atol=1e-6)
        np.testing.assert_allclose(seen[channel][~hole], whole[channel][~hole], atol=0.02)
    assert (seen["Z"][hole] == 0).all()
    if edges == "black":
        assert "A" not in seen
    else:
        assert (seen["A"][hole] == 0).all()
        np.testing.assert_allclose(seen["A"][away], whole["A"][away] if "A" in whole else 1, atol=1e-4)


def test_what_is_nowhere_cannot_be_turned_round_or_flow(folder: Path, fluidwarp: Run):
    values = np.zeros((HEIGHT, WIDTH, 2), np.float32)
    values[3, 4] = np.nan
    write_map(folder / "m.npy", Displacement(values))
    ran = fluidwarp(folder, "convert", "m.npy", "-o", "n.npy", "--invert")
    assert (ran.returncode, "cannot be inverted" in ran.stderr) == (1, True)
    (folder / "b.toml").write_text('map = "m.npy"\n' + RECIPE)
    ran = fluidwarp(folder, "render", "b.toml", "plate.1001.exr", "-o", "w.png")
    assert (ran.returncode, "1 of its pixels are NaN" in ran.stderr) == (1, True)


@pytest.mark.parametrize("name", ["plate.", "plate (2) [a+b]."])
def test_what_of_a_sequence_is_not_used_is_told(folder: Path, name: str):
    for path in folder.glob("plate.*"):
        path.rename(folder / path.name.replace("plate.", name))
    assert open_source(folder / f"{name}####.exr").picture.note == ""
    assert open_source(folder / f"{name}####.exr", animated=False).picture.note == (
        f"{name}####.exr: of its 4 frames only the first is used"
    )
    (folder / f"{name}-001.exr").touch()
    (folder / f"{name}-002.exr.txt").touch()
    assert open_source(folder / f"{name}####.exr").picture.note == (
        f"{name}####.exr: a file with a number below 0 is not used"
    )


def test_a_sequence_of_one_file_is_a_clip_only_where_an_animation_is_made(folder: Path):
    for number in (1002, 1003, 1004):
        (folder / f"plate.{number}.exr").unlink()
    still, moving = (open_source(folder / "plate.####.exr", animated=animated) for animated in (False, True))
    assert (still.clip, still.picture.note) == (None, "")
    assert moving.clip is not None
    assert np.array_equal(still.picture.pixels, moving.picture.pixels)
