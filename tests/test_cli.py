"""The command line as its user meets it: with files, in a process of its own, and with everything that can be wrong."""

from __future__ import annotations

import errno
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib import metadata
from inspect import signature
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from PIL import Image

from app import cli, doctor, progress
from app.errors import BUG, Cancelled, UserError
from app.gallery import figures, retouching
from app.media.displacement import Displacement, PixelPlaces
from app.media.maps import Kind, read_map, write_map
from app.media.pictures import read_picture, write_picture
from app.media.project import from_recipe, save
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.progress import Progress, leave
from app.ui import window
from app.work.export import run
from app.work.jobs import Job, Outputs
from solver.gl.context import GPU, NoSuchDevice
from solver.gl.device import Device
from support.commands import Run
from support.permissions import as_a_user, needs_permissions

ROOT = Path(__file__).parent.parent
BRIEFLY = "--evaluations", "1"
RECIPE = """
picture = "cat.png"
duration = 0.2
[fluid]
grid = 32
dt = 0.02
[[force]]
name = "whirl"
kind = "vortex"
point = [0.5, 0.5]
radius = 0.3
strength = 5
[output]
fps = 20
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    y, x = np.mgrid[0:48, 0:64]
    stripes = np.where((x // 8 + y // 8) % 2, 220, 40)
    write_picture(tmp_path / "cat.png", Picture(np.stack([stripes, x * 3, y * 4], axis=-1).astype(np.uint8)))
    (tmp_path / "a.toml").write_text(RECIPE)
    return tmp_path


def process(folder: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """`fluidwarp words...` in `folder`, in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "app", *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
        capture_output=True,
        text=True,
        timeout=100,
    )


def here(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


# -- what works -------------------------------------------------------------------------------------------------------


def test_a_picture_twice_is_the_same_bytes(folder: Path, fluidwarp: Run):
    """In a process of its own and in this one, whose driver draws without threads."""
    for name, render in (("one.png", process), ("two.png", fluidwarp)):
        ran = render(folder, "render", "a.toml", "-o", name)
        assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")
    assert (folder / "one.png").read_bytes() == (folder / "two.png").read_bytes()
    before, after = read_picture(folder / "cat.png").pixels, read_picture(folder / "one.png").pixels
    assert after.shape == before.shape
    assert (after != before).any()


@pytest.mark.parametrize("module", ["app", "app.cli"])
def test_both_modules_are_the_command(folder: Path, module: str):
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", module, "render", "none.toml"]
    ran = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert ran.returncode != 0
    assert "Cannot read none.toml: there is no such file" in ran.stderr


def test_a_sequence_with_numbers_ends_as_the_picture(folder: Path, fluidwarp: Run):
    assert fluidwarp(folder, "render", "a.toml", "-o", "end.png").returncode == 0
    ran = fluidwarp(folder, "render", "a.toml", "-o", "f.%02d.png", "--stats", "s.json")
    assert (ran.returncode, ran.stderr) == (0, "")
    frames = sorted(name for name in here(folder) if name.startswith("f."))
    assert frames == [f"f.{number:02d}.png" for number in range(5)]
    pixels = [read_picture(folder / name).pixels for name in (frames[0], "cat.png", frames[-1], "end.png")]
    assert np.array_equal(pixels[0], pixels[1])
    assert np.array_equal(pixels[2], pixels[3])
    numbers = json.loads((folder / "s.json").read_text())["frames"]
    assert [entry["tick"] for entry in numbers] == [0, 2.5, 5, 7.5, 10]
    assert numbers[-1]["divergence_left"] < 1e-2
    assert numbers[-1]["folds"] == 0
    assert {"advect", "diffuse", "project", "warp map"} <= numbers[-1]["milliseconds"].keys()


def test_the_gallery_draws_the_figures_or_what_is_painted_and_tells_what_was_measured(
    folder: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch
):
    for module, name in ((figures, "figures"), (retouching, "retouching")):
        made = {name: {"folds": 0, "sharpness": 0.5}}
        monkeypatch.setattr(module, "make", lambda device, output, progress, made=made: made)
    for words, name in (((), "figures"), (("--strokes",), "retouching")):
        ran = fluidwarp(folder, "gallery", "-o", "x", *words)
        assert (ran.returncode, ran.stdout) == (0, f"{name}: folds 0, sharpness 0.5\n")


@pytest.mark.parametrize(
    ("line", "what", "steps", "at_once"),
    [
        ("render a.toml -o b.png --map m.npy", "b.png", None, leave),
        ("render a.toml cat.png b.png -o out", "2 pictures", 2, leave),
        ("render a.toml cat.png -o out/ --jobs 2", "1 picture", 1, None),
        ("apply m.npy cat.png -o c.png", "c.png", None, leave),
        ("convert m.npy -o n.flo", "n.flo", None, leave),
        ("fit a.toml --pairs p.csv -o f.toml", "f.toml", None, None),
        ("gallery -o x", "gallery", None, leave),
    ],
)
def test_a_bar_tells_what_is_made_and_of_how_many_steps(
    folder: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch, line: str, what: str, steps: int | None, at_once: Any
):
    """And what a second Ctrl+C does: nothing at once where processes or the best so far have to be waited for."""
    heard = []

    def listen(description: str, total: int | None, at_once: Any = leave, warn: Any = None) -> Any:
        heard.append((description, total, at_once))
        raise UserError("that is all")

    monkeypatch.setattr(progress, "on_terminal", listen)
    write_map(folder / "m.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    write_picture(folder / "b.png", read_picture(folder / "cat.png"))
    (folder / "p.csv").write_text("20,20,23,21\n")
    ran = fluidwarp(folder, *line.split())
    assert (heard, "that is all" in ran.stderr) == ([(what, steps, at_once)], True)


def test_names_in_capitals_are_of_the_same_kind(folder: Path, fluidwarp: Run):
    (folder / "A.TOML").write_text(RECIPE)
    (folder / "P.CSV").write_text("20,20,23,21\n")
    made = []
    for as_told in (str.lower, str.upper):
        p, *names = (as_told(name) for name in ("p.csv", "b.png", "m.npy", "m.flo", "c.tif", "q.csv", "f.toml"))
        (folder / "p.csv").write_bytes((folder / "P.CSV").read_bytes())
        b, m, flo, c, q, f = names
        for words in (
            ("render", as_told("a.toml"), "-o", b, "--map", m), ("convert", m, "-o", flo), ("apply", flo, b, "-o", c),
            ("fit", as_told("a.toml"), "--pairs", p, "-o", f, "--arrived", q, *BRIEFLY),
        ):  # fmt: skip
            ran = fluidwarp(folder, *words)
            assert ran.returncode == 0, ran.stderr
        made.append([(folder / name).read_bytes() for name in names])
        for name in names:
            (folder / name).unlink()
    assert made[0] == made[1]


def test_a_picture_in_place_of_a_projects_own_is_what_is_read(folder: Path, fluidwarp: Run):
    (folder / "p.csv").write_text("10,10,11,11\n")
    save(from_recipe(folder / "a.toml"), folder / "w.fluidwarp")
    write_picture(folder / "dog.png", Picture(np.zeros((30, 20, 3), np.uint8)))
    for words in (("--image", "cat.png", "-o", "cat.png"), ("--image", "dog.png", "--map", "m.npy", "-o", "dog.png")):
        ran = fluidwarp(folder, "render", "w.fluidwarp", *words)
        assert (ran.returncode, f"{words[1]} would be replaced by its own result" in ran.stderr) == (1, True)
    ran = fluidwarp(folder, "fit", "w.fluidwarp", "--image", "dog.png", "--pairs", "p.csv", "-o", "f.toml", *BRIEFLY)
    assert ran.returncode == 0, ran.stderr
    assert Recipe.parse((folder / "f.toml").read_text()).picture == "dog.png"


def test_options_instead_of_the_recipe(folder: Path, fluidwarp: Run):
    write_picture(folder / "dog.png", Picture(np.zeros((30, 20, 3), np.uint8)))
    words = ["--image", "dog.png", "--size", "60", "--grid", "16", "--solver", "paper", "--duration", "0.1"]
    ran = fluidwarp(folder, "render", "a.toml", "-o", "out.jpg", *words, "--map", "m.tif", "--offsets")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert read_picture(folder / "out.jpg").pixels.shape == (60, 40, 3)
    assert np.array_equal(read_map(folder / "m.tif").values, read_map(folder / "m.tif", kind="offsets").values)


def test_a_project_is_a_recipe(folder: Path, fluidwarp: Run):
    """With its picture in it, and rendered to the same bytes."""
    save(from_recipe(folder / "a.toml"), folder / "a.fluidwarp")
    assert fluidwarp(folder, "render", "a.toml", "-o", "a.png").returncode == 0
    (folder / "cat.png").unlink()
    ran = fluidwarp(folder, "render", "a.fluidwarp", "-o", "b.png")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert (folder / "a.png").read_bytes() == (folder / "b.png").read_bytes()


def test_several_pictures(folder: Path, fluidwarp: Run):
    write_picture(folder / "dog.png", Picture(np.zeros((30, 20, 3), np.uint8)))
    ran = fluidwarp(folder, "render", "a.toml", "cat.png", "dog.png", "-o", "{name} warped.png")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert {"cat warped.png", "dog warped.png"} <= here(folder)


def test_the_folder_of_a_result_that_is_named_after_its_picture_is_made(folder: Path, fluidwarp: Run):
    """As one that is given alone is: of one picture or several, and one for each; none is left that is empty."""
    write_picture(folder / "dog.png", Picture(np.zeros((48, 64, 3), np.uint8)))
    write_map(folder / "m.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    for words in (["render", "a.toml"], ["apply", "m.npy"]):
        for pictures, output in ((["cat", "dog"], "new/in/{name}.jpg"), (["cat"], "one/{name}.jpg"),
                                 (["cat", "dog"], "{name}/x.jpg")):  # fmt: skip
            ran = fluidwarp(folder, *words, *(f"{picture}.png" for picture in pictures), "-o", output)
            assert (ran.returncode, ran.stderr) == (0, "")
            for picture in pictures:
                (folder / output.format(name=picture)).unlink()
            for made in ("new/in", "new", "one", *pictures):
                if (folder / made).exists():
                    (folder / made).rmdir()
        before = here(folder)
        for pictures, output in ((["none", "gone"], "{name}/x.jpg"), (["none"], "new/{name}.jpg")):
            assert fluidwarp(folder, *words, *(f"{picture}.png" for picture in pictures), "-o", output).returncode == 1
            assert here(folder) == before


def test_a_name_that_only_looks_as_if_it_numbered_files_is_refused(folder: Path, fluidwarp: Run):
    """It was the name of one still; as the name of what is there it is taken as it stands."""
    write_map(folder / "m.%4d.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    before = here(folder)
    for number in ("%99999d", "%4d", "%0100d"):
        said = f"{number} does not number its files; write %d, or %04d for 4 digits (99 at most)"
        for words in (
            ["render", "a.toml", "-o", f"x.{number}.png"], ["render", "a.toml", "--map", f"x.{number}.exr"],
            ["apply", "m.%4d.npy", "cat.png", "-o", f"x.{number}.png"],
            ["convert", "m.%4d.npy", "-o", f"x.{number}.exr"],
        ):  # fmt: skip
            ran = fluidwarp(folder, *words)
            assert (ran.returncode, ran.stderr) == (1, f"fluidwarp: Cannot write {words[-1]}: {said}.\n")
    assert here(folder) == before
    assert fluidwarp(folder, "apply", "m.%4d.npy", "cat.png", "-o", "x.png").returncode == 0


def test_a_file_whose_name_has_a_number_s_place_is_that_file(folder: Path, fluidwarp: Run):
    """If there is one of exactly that name; as a result it would be a sequence, which nobody has asked for."""
    (folder / "50%d.png").write_bytes((folder / "cat.png").read_bytes())
    write_map(folder / "50%d.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    for words in (["render", "a.toml"], ["apply", "50%d.npy"]):
        ran = fluidwarp(folder, *words, "50%d.png", "-o", "501.png")
        assert (ran.returncode, ran.stderr) == (0, "")
        before = here(folder)
        for output in ("{name}-w.png", "new"):
            ran = fluidwarp(folder, *words, "cat.png", "50%d.png", "-o", output)
            line = "a result named after 50%d.png would be a sequence of numbered files; rename 50%d.png"
            assert (ran.returncode, ran.stderr) == (1, f"fluidwarp: {line}\n")
        ran = fluidwarp(folder, *words, "50%d.png", "-o", "50%d.png")
        assert (ran.returncode, ran.stderr) == (
            1,
            "fluidwarp: 50%d.png would be replaced by its own result; choose another name\n",
        )
        assert here(folder) == before


def test_the_other_pictures_of_a_recipe_are_looked_for_beside_it(folder: Path, fluidwarp: Run):
    (folder / "elsewhere").mkdir()
    mask = '[[viscosity]]\nkind = "picture"\npicture = "cat.png"\nscale = 1.0\n'
    (folder / "a.toml").write_text(RECIPE + mask)
    assert fluidwarp(folder, "render", "a.toml", "-o", "a.png").returncode == 0
    ran = fluidwarp(folder / "elsewhere", "render", "../a.toml", "-o", "a.png")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert (folder / "elsewhere" / "a.png").read_bytes() == (folder / "a.png").read_bytes()


def test_a_command_stays_one_whatever_lies_in_the_folder(folder: Path, fluidwarp: Run):
    (folder / "convert").write_text("")
    assert "none.npy: there is no such file" in fluidwarp(folder, "convert", "none.npy", "-o", "x.npy").stderr


def test_an_animation_that_would_begin_after_its_end_is_told(folder: Path, fluidwarp: Run):
    ran = fluidwarp(folder, "render", "a.toml", "-o", "b.gif", "--from", "99")
    assert ran.returncode == 1
    assert re.fullmatch(r"fluidwarp: the animation ends at [\d.]+ s, and cannot begin at 99 s; .*\n", ran.stderr)
    assert here(folder) == {"a.toml", "cat.png"}


def test_the_loss_of_a_clips_depth_is_told(folder: Path, fluidwarp: Run):
    from app.media.ffmpeg import executable

    ten = ["-f", "lavfi", "-i", "testsrc=s=64x48:r=10:d=0.2", "-pix_fmt", "yuv420p10le", "-c:v", "ffv1"]
    subprocess.run([executable(), "-v", "error", *ten, str(folder / "in.mkv")], check=True)
    line = "fluidwarp: in.mkv: its 10 bits a channel become 8\n"
    assert fluidwarp(folder, "render", "a.toml", "in.mkv", "-o", "out.mp4").stderr == line
    write_map(folder / "m.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    assert fluidwarp(folder, "apply", "m.npy", "in.mkv", "-o", "applied.mp4").stderr == line


def test_animation_stopped_and_turned(folder: Path, fluidwarp: Run):
    (folder / "b.toml").write_text(
        RECIPE + "[stop]\ndisplacement_above = 0.03\n[time]\nreverse = true\nping_pong = true"
    )
    ran = fluidwarp(folder, "render", "b.toml", "-o", "b.gif", "--stats", "b.json")
    assert ran.returncode == 0
    assert "largest displacement 0.03" in ran.stderr
    assert ran.stderr.startswith("fluidwarp: stopped at t = ")
    assert (folder / "b.gif").read_bytes()[:6] == b"GIF89a"
    stopped = json.loads((folder / "b.json").read_text("utf-8"))["stopped"]
    assert stopped in ran.stderr


def test_density_mode_moves_values(folder: Path, fluidwarp: Run):
    (folder / "b.toml").write_text('mode = "density"\n' + RECIPE + "[density]\nkappa = 0.01\n")
    ran = fluidwarp(folder, "render", "b.toml", "-o", "b.png")
    assert (ran.returncode, ran.stderr) == (0, "")
    after = read_picture(folder / "b.png").pixels
    assert after.shape == (48, 64, 3)
    assert after[..., 0].std() < 0.6 * read_picture(folder / "cat.png").pixels[..., 0].std()


def test_doctor(folder: Path):
    ran = process(folder, "doctor", DISPLAY="", WAYLAND_DISPLAY="")
    assert ran.returncode == 0
    assert "OpenGL" in ran.stdout
    assert "no display" in ran.stdout
    assert "missing" not in ran.stdout


def test_doctor_fails_where_something_vital_is_missing(folder: Path):
    nothing = {"__EGL_VENDOR_LIBRARY_DIRS": str(folder), "LIBGL_DRIVERS_PATH": str(folder), "DISPLAY": ":9999"}
    ran = process(folder, "doctor", **nothing)
    assert ran.returncode == 1
    assert "missing" in ran.stdout
    for whole in ("apt-get install", "Failed to open display :9999", "check that the display is there"):
        assert any(whole in line for line in ran.stdout.splitlines()), "a command to copy stays on its line"


@pytest.mark.skipif(sys.platform != "linux", reason="of Mesa")
def test_where_there_is_no_driver_one_sentence_says_so_and_doctor_has_the_drivers_own_words(folder: Path):
    (folder / "b.toml").write_text(RECIPE)
    nothing = {"LIBGL_DRIVERS_PATH": str(folder), "GALLIUM_DRIVER": "nonsense", "DISPLAY": "", "WAYLAND_DISPLAY": ""}
    ran = process(folder, "render", "b.toml", "-o", "b.png", **nothing)
    assert ran.returncode == 1
    (line,) = ran.stderr.splitlines()
    assert line.startswith("fluidwarp: no OpenGL 3.3 without a window")
    asked = process(folder, "render", "b.toml", "-o", "b.png", **nothing, EGL_LOG_LEVEL="warning").stderr
    assert "libEGL" in asked, "who asks for the driver's own words has them"
    assert "the driver says: libEGL" in " ".join(process(folder, "doctor", **nothing).stdout.split())


@pytest.mark.skipif(sys.platform != "linux", reason="devices are numbered by EGL")
def test_doctor_tries_the_device_that_is_asked_for(folder: Path):
    ran = process(folder, "doctor", DISPLAY="", WAYLAND_DISPLAY="", **{GPU: "99999"})
    assert ran.returncode == 1
    assert "give FLUIDWARP_GPU another number, or none" in ran.stdout


def test_doctor_finds_what_is_missing(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(doctor, "LIBRARIES", ("numpy", "no-such-library"))
    found = next(finding for finding in doctor.examine() if finding.name == "libraries")
    assert found.vital
    assert found.mend == "pip install no-such-library"


@pytest.mark.parametrize(
    ("system", "said"),
    [("linux", "no display: neither"), ("darwin", "Cocoa, OpenGL 4.1"), ("win32", "Cocoa, OpenGL 4.1")],
)
def test_only_on_linux_a_window_needs_the_name_of_a_display(monkeypatch: pytest.MonkeyPatch, system: str, said: str):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    window = {"platform": "Cocoa", "opengl": "4.1"}
    monkeypatch.setattr(doctor, "ask", lambda of, **named: window if of == "app.ui.probe" else {"error": "no OpenGL"})
    monkeypatch.setattr(sys, "platform", system)
    found = next(finding for finding in doctor.examine() if finding.name == "window")
    assert found.said.startswith(said)


def test_doctor_lists_the_graphics_devices(monkeypatch: pytest.MonkeyPatch):
    """Each is asked in a process with its number; one that does not work is told, and is not the end of the list."""

    def answer(module: str, **environment: str) -> dict[str, object]:
        working = {"renderer": "Card", "vendor": "Maker"}
        return {"99999": {"error": "not there", "devices": 3}, "1": {"error": "no driver"}}.get(
            environment[GPU], working
        )

    monkeypatch.setattr(doctor, "ask", answer)
    found = {finding.name: (finding.said, finding.is_well) for finding in doctor.devices()}
    assert found == {
        "--gpu 0": ("Card (Maker)", True), "--gpu 1": ("no driver", False), "--gpu 2": ("Card (Maker)", True)
    }  # fmt: skip


WRITING = [
    ["render", "a.toml", "-o", "x.png"],
    ["apply", "m.npy", "cat.png", "-o", "x.png"],
    ["convert", "m.npy", "-o", "x.exr", "--invert"],
    ["fit", "a.toml", "-o", "x.toml"],
    ["gallery", "-o", "x"],
]


@pytest.mark.parametrize("words", WRITING)
@pytest.mark.parametrize(
    ("output", "told"), [("-", "a result is a file, and not standard output (-)"), (".png", "is an ending without")]
)
def test_no_command_writes_to_what_is_no_name(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str], output: str,
    told: str,
):  # fmt: skip
    before = here(folder)
    monkeypatch.chdir(folder)
    words = [output if word.startswith("x") else word for word in words]
    monkeypatch.setattr(sys, "argv", ["fluidwarp", *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code in (1, 2)
    assert told in capsys.readouterr().err
    assert here(folder) == before


@pytest.mark.parametrize("words", WRITING)
def test_a_device_is_chosen_and_one_that_is_not_there_is_told(
    folder: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch, words: list[str]
):
    chosen: list[str] = []

    def headless(kind: type[Device]) -> Device:
        chosen.append(os.environ[GPU])
        raise NoSuchDevice(7, 2)

    monkeypatch.setattr(Device, "headless", classmethod(headless))
    monkeypatch.setenv(GPU, "1")
    write_map(folder / "m.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    if words[0] == "fit":
        (folder / "a.toml").write_text(RECIPE + "[[handle]]\nat = [0.3, 0.4]\nto = [0.4, 0.4]\n")
    ran = fluidwarp(folder, *words, "--gpu", "7")
    assert chosen == ["7"]
    assert ran.returncode == 1
    assert ran.stderr == ("fluidwarp: graphics device 7 is not there; there is 0 to 1; `fluidwarp doctor` tells more\n")
    assert not {path.name for path in folder.iterdir() if path.name.startswith("x.")}


def test_the_devices_of_a_cluster_are_chosen_there(folder: Path, fluidwarp: Run):
    words = ["render", "a.toml", "cat.png", "-o", "all", "--cluster", "tcp://localhost:1", "--gpu", "0"]
    ran = fluidwarp(folder, *words)
    assert ran.returncode == 1
    assert "start the workers of --cluster with FLUIDWARP_GPU set" in ran.stderr


@pytest.mark.parametrize("words", [["cat.png"], ["frames.%04d.png"], ["./render"], ["edit", "cat.png"], ["edit"], []])
def test_a_file_alone_is_what_the_editor_opens(
    folder: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch, words: list[str]
) -> None:
    opened: list[Path | None] = []
    monkeypatch.setattr(window, "run", opened.append)
    (folder / "render").write_bytes((folder / "cat.png").read_bytes())
    assert fluidwarp(folder, *words).returncode == 0
    name = next((word for word in words if word != "edit"), None)
    assert opened == [name and Path(name)]


@pytest.mark.parametrize("command", ["edit", "render", "fit", "apply", "convert", "gallery", "doctor"])
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--bogus"], "no such option: --bogus"),
        (["--bogus=\x1b[2J"], "no such option: --bogus"),
        (["a", "b", "c", "--gpu", "-1"], ""),
    ],
    ids=["option", "control characters", "value or too many"],
)
def test_wrong_words_of_a_command_are_told_in_one_line(
    command: str, words: list[str], said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["fluidwarp", command, *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    told = capsys.readouterr()
    assert (ended.value.code, told.out) == (2, "")
    assert told.err.startswith(f"fluidwarp: {said}")
    assert told.err.endswith(f"`fluidwarp {command} --help` explains what is wanted\n")
    assert told.err.count("\n") == 1
    assert "\x1b" not in told.err


@pytest.mark.parametrize("words", [["render"], ["render", "-o"], ["fit", "--gpu"], ["--bogus"], ["fit", "x.toml"]])
def test_missing_words_are_told_in_one_line(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["fluidwarp", *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    told = capsys.readouterr()
    assert (ended.value.code, told.out, told.err.count("\n")) == (2, "", 1)
    command = f" {words[0]}" if words[0] in ("render", "fit") else ""
    assert told.err.endswith(f"`fluidwarp{command} --help` explains what is wanted\n")


READ_ONLY = {
    ("render", "a.toml", "-o", "shut/x.png"): "Cannot write shut/x.png: no permission",
    ("render", "a.toml", "-o", "shut/x.mp4"): "Cannot write shut/x.mp4: no permission",
    ("render", "a.toml", "-o", "shut/x.%04d.png"): "Cannot write shut/x.%04d.png: no permission",
    ("render", "a.toml", "-o", "old.png"): "Cannot write old.png: that file is read-only",
    ("render", "a.toml", "-o", "x.png", "--map", "shut/m.exr"): "Cannot write shut/m.exr: no permission",
    ("render", "a.toml", "-o", "x.png", "--stats", "shut/s.json"): "Cannot write shut/s.json: no permission",
    ("render", "a.toml", "-o", "x.png", "--states", "shut/states"): "Cannot write shut/states: no permission",
    ("render", "a.toml", "cat.png", "cat.png", "-o", "shut/{name}-w.png"): "would both become",
    ("render", "a.toml", "cat.png", "dog.png", "-o", "shut"): "Cannot write shut: no permission",
    ("render", "a.toml", "cat.png", "dog.png", "-o", "shut/new"): "Cannot write shut/new: no permission",
    ("render", "a.toml", "-i", "secret.png", "-o", "x.png"): "Cannot read secret.png: no permission to read it",
    ("render", "none/a.toml", "-o", "x.png"): "Cannot read none/a.toml: no permission to read it",
    ("render", "a.toml", "-o", "none/x.png"): "Cannot write none/x.png: no permission",
    ("apply", "m.npy", "cat.png", "-o", "shut/x.png"): "Cannot write shut/x.png: no permission",
    ("convert", "m.npy", "-o", "shut/m.exr"): "Cannot write shut/m.exr: no permission",
    ("fit", "a.toml", "-o", "shut/b.toml"): "Cannot write shut/b.toml: no permission",
    ("gallery", "-o", "shut/gallery"): "Cannot write shut/gallery: no permission",
    ("render", "a.toml", "secret.png", "-o", "x.png"): "Cannot read secret.png: no permission to read it",
    ("apply", "secret.npy", "cat.png", "-o", "x.png"): "Cannot read secret.npy: no permission to read it",
    ("apply", "m.npy", "secret.png", "-o", "x.png"): "Cannot read secret.png: no permission to read it",
    ("convert", "secret.npy", "-o", "x.exr"): "Cannot read secret.npy: no permission to read it",
    ("fit", "a.toml", "--pairs", "secret.csv", "-o", "b.toml"): "Cannot read secret.csv: no permission to read it",
    ("fit", "a.toml", "--masks", "secret.png", "cat.png", "-o", "b.toml"): "Cannot read secret.png: no permission",
    ("fit", "a.toml", "--masks", "cat.png", "secret.png", "-o", "b.toml"): "Cannot read secret.png: no permission",
    ("fit", "a.toml", "-i", "secret.png", "-o", "b.toml"): "Cannot read secret.png: no permission to read it",
    ("render", "a.toml", "-o", "secret.png"): "Cannot write secret.png: that file is read-only",
    ("render", "a.toml", "-o", "x.png", "--map", "secret.npy"): "Cannot write secret.npy: that file is read-only",
    ("render", "a.toml", "-o", "x.png", "--stats", "secret.csv"): "Cannot write secret.csv: that file is read-only",
    ("convert", "m.npy", "-o", "secret.npy"): "Cannot write secret.npy: that file is read-only",
    ("fit", "a.toml", "-o", "secret.toml"): "Cannot write secret.toml: that file is read-only",
    ("gallery", "-o", "none"): "Cannot write none/figure-1-density.mp4: no permission",
    ("fit", "a.toml", "-o", "b.toml", "--arrived", "secret.csv"): "Cannot write secret.csv: that file is read-only",
}


@needs_permissions
def test_where_permissions_forbid_it_a_sentence_says_so_and_nothing_is_touched(folder: Path):
    write_map(folder / "m.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    for name in ("secret.png", "old.png", "dog.png"):
        (folder / name).write_bytes((folder / "cat.png").read_bytes())
    for name, mode in {"shut": 0o555, "none": 0}.items():
        (folder / name).mkdir()
        (folder / name / "a.toml").write_text(RECIPE)
        (folder / name).chmod(mode)
    for name in ("secret.png", "secret.npy", "secret.csv", "secret.toml"):
        (folder / name).touch()
        (folder / name).chmod(0)
    (folder / "old.png").chmod(0o444)
    code = f"""
import sys
from app import cli
for words in {list(READ_ONLY)!r}:
    sys.argv = ["fluidwarp", *words]
    try:
        cli.main()
    except SystemExit as ended:
        print(ended.code, file=sys.stderr)
"""
    before = here(folder)
    try:
        told = as_a_user(code, folder).stderr.splitlines()
        assert here(folder) == before
        assert here(folder / "shut") == {"a.toml"}
    finally:
        (folder / "none").chmod(0o755)
    assert told[1::2] == ["1"] * len(READ_ONLY)
    for line, said in zip(told[::2], READ_ONLY.values(), strict=True):
        assert line.startswith("fluidwarp: ")
        assert said in line


@needs_permissions
@pytest.mark.parametrize("mode", [0, 0o444, 0o555], ids=oct)
def test_where_no_states_may_be_kept_that_is_told_and_the_result_is_written(folder: Path, mode: int):
    """Also where the folder may not be searched: that was called a bug, after the last frame."""
    (folder / "states").mkdir()
    (folder / "states").chmod(mode)
    words = ["fluidwarp", "render", "a.toml", "-o", "x.png", "--states", "states"]
    try:
        told = as_a_user(f"import sys; sys.argv = {words!r}; from app import cli; cli.main()", folder)
    finally:
        (folder / "states").chmod(0o755)
    (line,) = told.stderr.splitlines()
    assert told.returncode == 0
    assert line.startswith("fluidwarp: No more states are kept: Cannot write states/")
    assert "no permission" in line
    assert (folder / "x.png").exists()
    assert not list((folder / "states").iterdir())


# -- what does not ----------------------------------------------------------------------------------------------------


def test_a_mistake_of_ours_has_a_status_of_its_own(folder: Path):
    broken = "import app.cli\napp.cli.cli = lambda **_: 1 / 0\napp.cli.main()"
    ran = subprocess.run(
        [sys.executable, "-c", broken],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 70
    assert ran.stderr.startswith("fluidwarp: this is a bug in fluidwarp (ZeroDivisionError: division by zero);")
    assert len(ran.stderr.splitlines()) == 1


def test_no_egl_is_told(folder: Path):
    nothing = {"__EGL_VENDOR_LIBRARY_DIRS": str(folder), "LIBGL_DRIVERS_PATH": str(folder), "DISPLAY": ""}
    ran = process(folder, "render", "a.toml", "-o", "out.png", **nothing)
    assert ran.returncode != 0
    assert "apt-get install" in ran.stderr
    assert len(ran.stderr.splitlines()) <= 2
    assert "out.png" not in here(folder)


BAD = {
    "no such recipe": (["b.toml", "-o", "x.png"], "Cannot read b.toml: there is no such file"),
    "no such name": (["nonesuch", "-o", "x.png"], "nonesuch does not exist; recipes that come with fluidwarp"),
    "a picture as recipe": (["cat.png", "-o", "x.png"], "cat.png is a picture and not a recipe"),
    "a clip as recipe": (["a.mov", "-o", "x.mp4"], "a.mov is a clip and not a recipe"),
    "no such picture": (["a.toml", "-i", "dog.png", "-o", "x.png"], "dog.png"),
    "truncated picture": (["a.toml", "-i", "cut.png", "-o", "x.png"], "cut.png"),
    "no picture": (["a.toml", "-i", "a.toml", "-o", "x.png"], "a.toml"),
    "1 x 1": (["a.toml", "-i", "dot.png", "-o", "x.png"], "1 x 1 pixels"),
    "1 x 5000": (["a.toml", "-i", "line.png", "-o", "x.png"], "1 x 5000 pixels"),
    "too narrow for any": (["a.toml", "-i", "thread.png", "-o", "x.png"], "too narrow for any grid; crop it"),
    "unknown ending": (["a.toml", "-o", "x.xyz"], "x.xyz"),
    "no ending": (["a.toml", "-o", "x"], "Cannot write x"),
    "an empty name": (["a.toml", "-o", ""], "one of the words of this command is empty"),
    "an unknown video": (["a.toml", "-o", "x.avi"], ".exr, an animation's in .mp4"),
    "a sequence of videos": (["a.toml", "-o", "x.%04d.mp4"], "leave out the number for one .mp4"),
    "no such folder": (["a.toml", "-o", "none/x.png"], "none"),
    "a folder": (["a.toml", "-o", "sub.png"], "it is a folder"),
    "stats nowhere": (["a.toml", "-o", "x.png", "--stats", "none/s.json"], "none"),
    "onto its source": (["a.toml", "-i", "cat.png", "-o", "cat.png"], "cat.png would be replaced by its own result"),
    "onto the recipe's picture": (["a.toml", "-o", "sub.png/../cat.png"], "would be replaced by its own result"),
    "a sequence onto its source": (
        ["a.toml", "-i", "cat.0003.png", "-o", "./cat.%04d.png"], "cat.0003.png would be replaced by its own result"
    ),
    "a sequence onto another's": (
        ["a.toml", "cat.png", "cat.0003.png", "-o", "{name}.%04d.png"], "cat.0003.png would be replaced by what cat.png"
    ),
    "numbers onto the result": (["a.toml", "-o", "x.png", "--stats", "x.png"], "x.png cannot hold two results"),
    "numbers onto the recipe": (["a.toml", "--stats", "a.toml"], "a.toml would be replaced by its own result"),
    "map onto the first map": (["map.toml", "--map", "m.exr"], "m.exr would be replaced by its own result"),
    "map without a name": (["a.toml", "-o", "x.exr", "--forward"], "say how --map is written"),
    "too long": (["a.toml", "-o", "x" * 300 + ".png"], "the name is too long"),
    "too long to be read": (["a.toml", "-i", "x" * 300 + ".mp4", "-o", "x.png"], "the name is too long; check it"),
    "too long a recipe": (["x" * 300 + ".toml", "-o", "x.png"], "the name is too long; check it"),
    "states in a file": (["a.toml", "-o", "x.png", "--states", "cat.png"], "a file of this name is in the way"),
    "no place for a folder": (["a.toml", "cat.png", "-o", "cat.png/sub"], "a part of its path is a file"),
    "two of one name": (["a.toml", "cat.png", "cat.png", "-o", "new"], "would both become"),
    "no address": (["a.toml", "cat.png", "-o", "sub.png", "--cluster", "here"], "give for example tcp://host:8786"),
    "to standard output": (["a.toml", "-o", "-"], "and not standard output (-); give it a name, such as out.png"),
    "a folder to standard output": (["a.toml", "cat.png", "-o", "-"], "and not standard output (-)"),
    "states to standard output": (["a.toml", "-o", "x.png", "--states", "-"], "and not standard output (-)"),
    "numbers to standard output": (["a.toml", "-o", "x.png", "--stats", "-"], "and not standard output (-)"),
    "an ending alone": (["a.toml", "cat.png", "-o", ".png"], ".png is an ending without a name; give one such as out"),
    "frames in other digits": (["a.toml", "-o", "x.gif", "--frames", "１-２"], "--frames must be like 0-99, 100- or 7"),
    "dpi nan": (["a.toml", "-o", "x.png", "--dpi", "nan"], "--dpi must be a finite number, not nan"),
    "dpi 0": (["a.toml", "-o", "x.png", "--dpi", "0"], "--dpi must be at least 1, not 0"),
    "bits": (["a.toml", "-o", "x.png", "--bits", "1.5"], "--bits must be a whole number, not 1.5"),
    "one of one": (["a.toml", "dog.png", "-o", "new"], "dog.png: there is no such file; check the name.\n"),
    "several into one": (["a.toml", "cat.png", "cat.png", "-o", "x.png"], "{name}"),
    "grid 0": (["a.toml", "-o", "x.png", "--grid", "0"], "--grid must be at least 8, not 0"),
    "fps nan": (["a.toml", "-o", "x.gif", "--fps", "nan"], "--fps must be a finite number"),
    "amount": (["a.toml", "-o", "x.png", "--amount", "1.6"], "--amount must be at most 1.5, not 1.6"),
    "filter": (["a.toml", "-o", "x.png", "--filter", "soft"], "--filter must be one of"),
    "size": (["a.toml", "-o", "x.png", "--size", "99999"], "--size must be at most 32768, not 99999"),
    "quality": (["a.toml", "-o", "x.jpg", "--quality", "0"], "--quality must be at least 1, not 0"),
    "from nan": (["a.toml", "-o", "x.gif", "--from", "nan"], "--from must be a finite number"),
    "back in time": (["a.toml", "-o", "x.gif", "--from", "2", "--to", "1"], "--to (1) is before --from (2)"),
    "duration": (["a.toml", "-o", "x.gif", "--duration", "1e7"], "--duration must be at most 1e+06"),
    "overscan": (["a.toml", "--map", "m.exr", "--overscan", "1000000"], "--overscan 1000000 makes a map of 2000064 x"),
    "overscan beyond all": (["a.toml", "--map", "m.exr", "--overscan", "9" * 30], f"--overscan {'9' * 30} makes"),
    "map size": (["a.toml", "--map", "m.exr", "--map-size", "1000000"], "--map-size 1000000 makes a map of 1000000 x"),
    "too wide for WebP": (["a.toml", "-o", "x.webp", "--size", "20000"], "WebP holds no side longer than 16383"),
    "a sequence of WebP": (["a.toml", "-o", "x.%d.webp", "--size", "20000"], "WebP holds no side longer than 16383"),
    "too wide for an animated WebP": (
        ["a.toml", "-o", "x.webp", "--animated", "--size", "20000"], "webp holds no more than 16383 x 16383"
    ),
    "too wide for H.264": (["a.toml", "-o", "x.mp4", "--size", "20000"], "h264 holds no more than 16384 x 16384"),
    "too high for AV1": (
        ["a.toml", "-o", "x.webm", "--codec", "av1", "--size", "12000"], "av1 holds no more than 16384 x 8704"
    ),
    "solver": (["a.toml", "-o", "x.png", "--solver", "best"], "--solver must be one of 'mac' or 'paper'"),
    "T = 0": (["T0.toml", "-o", "x.png"], "T0.toml, line 1: 'duration' must be greater than 0"),
    "unknown key": (["key.toml", "-o", "x.png"], "key.toml, line 6: force[1] \"x\": unknown key 'radios'"),
    "wrong type": (["type.toml", "-o", "x.png"], "type.toml, line 2: 'fluid.grid' must be a whole number, not \"64\""),
    "radius 0": (["radius.toml", "-o", "x.png"], "'radius' must be greater than 0, not 0"),
    "newer": (["newer.toml", "-o", "x.png"], "install a newer fluidwarp"),
    "not a recipe": (["cat.bin", "-o", "x.png"], "not text"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_told_in_a_sentence(
    case: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    """In this process, as all of it is told before any GL is touched."""
    words, expected = BAD[case]
    point = '[[force]]\nname = "x"\nkind = "vortex"\npoint = [0.5, 0.5]\n'
    for name, text in {
        "T0": "duration = 0",
        "key": f"duration = 1\n{point}radios = 1",
        "type": '[fluid]\ngrid = "64"',
        "radius": f"{point}radius = 0",
        "newer": "version = 99",
        "map": 'picture = "cat.png"\nmap = "m.exr"',
    }.items():
        (folder / f"{name}.toml").write_text(text)
    for name, shape in {"dot": (1, 1, 3), "line": (5000, 1, 3), "strip": (400, 20, 3), "thread": (6000, 8, 3)}.items():
        write_picture(folder / f"{name}.png", Picture(np.zeros(shape, np.uint8)))
    (folder / "cat.0003.png").write_bytes((folder / "cat.png").read_bytes())
    (folder / "cut.png").write_bytes((folder / "cat.png").read_bytes()[:60])
    (folder / "cat.bin").write_bytes(bytes(range(256)))
    (folder / "sub.png").mkdir()
    before = here(folder)

    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "argv", ["fluidwarp", "render", *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    told = capsys.readouterr()
    assert ended.value.code in (1, 2)
    assert told.out == ""
    assert expected in told.err
    assert told.err.startswith("fluidwarp: ")
    assert 1 <= len(told.err.splitlines()) <= 2
    assert here(folder) == before


FORCES = {
    "enormous": ("strength = 1e6", 'force[1] "x": at t = 0 s it throws the fluid'),
    "formula": ('formula = "1/(t-0.1)"', "divides by zero"),
}


def test_bad_forces_name_the_force(folder: Path, fluidwarp: Run):
    for text, expected in FORCES.values():
        force = f'[[force]]\nname = "x"\nkind = "point"\npoint = [0.5, 0.5]\ndirection = [1, 0]\n{text}\n'
        (folder / "b.toml").write_text(f'picture = "cat.png"\nduration = 0.2\n[fluid]\ngrid = 32\n{force}')
        ran = fluidwarp(folder, "render", "b.toml", "-o", "x.mp4")
        assert ran.returncode != 0
        assert expected in ran.stderr
        assert len(ran.stderr.splitlines()) <= 2
        assert here(folder) == {"a.toml", "b.toml", "cat.png"}


@pytest.mark.skipif(sys.platform != "linux", reason="names are text there")
def test_a_recipe_that_could_not_name_its_picture_is_not_fitted(folder: Path, fluidwarp: Run):
    picture = os.fsdecode(b"caf\xe9.png")
    (folder / "cat.png").rename(folder / picture)
    (folder / "b.toml").write_text(RECIPE + "[[handle]]\nat = [0.3, 0.4]\nto = [0.4, 0.4]\n")
    ran = fluidwarp(folder, "fit", "b.toml", "-i", picture, "-o", "c.toml")
    assert ran.returncode == 1
    assert ran.stderr == "fluidwarp: Cannot refer to caf\\udce9.png: its name is not UTF-8; rename it.\n"
    assert "c.toml" not in here(folder)


def test_a_force_that_never_acts_is_remarked_on(folder: Path, fluidwarp: Run):
    force = '[[force]]\nname = "x"\nkind = "point"\npoint = [0.5, 0.5]\ndirection = [1, 0]\nat = [7]\n'
    (folder / "b.toml").write_text(f'picture = "cat.png"\nduration = 0.2\n[fluid]\ngrid = 32\n{force}')
    ran = fluidwarp(folder, "render", "b.toml", "-o", "x.png")
    assert ran.returncode == 0
    assert 'force[1] "x" never acts: it starts at 7 s' in ran.stderr
    assert (folder / "x.png").exists()


@pytest.mark.parametrize("words", [("render", "a.toml", "cat.png", "dog.png", "-o", "out", "-j", "2"), ("doctor",)])
def test_no_module_in_the_present_folder_is_run(folder: Path, words: tuple[str, ...]) -> None:
    """A folder of somebody else's pictures may hold anything; the command itself begins without it, as installed."""
    (folder / "dog.png").write_bytes((folder / "cat.png").read_bytes())
    for module in ("app", "ctypes", "numpy", "pickle", "solver"):
        (folder / f"{module}.py").write_text(f"open('run-{module}', 'w')")
    ran = subprocess.run(
        [sys.executable, "-P", "-m", "app", *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert not list(folder.glob("run-*"))
    assert "Error" not in ran.stderr + ran.stdout
    if words[0] == "render":
        assert (ran.returncode, here(folder / "out")) == (0, {"cat.png", "dog.png"})


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names are UTF-8, whatever the locale")
@pytest.mark.parametrize("name", ["ß.png", "ß.%04d.png", "ß/a.%04d.png"])
def test_a_name_that_the_locale_has_no_letters_for_is_told(folder: Path, name: str) -> None:
    """Of an old farm without UTF-8, where a recipe comes from a desk with it."""
    (folder / "b.toml").write_text(f'picture = "{name}"\n[fluid]\ngrid = 32\n', "utf-8")
    ran = subprocess.run(
        [sys.executable, "-m", "app", "render", "b.toml", "-o", "x.png"],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT), "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 1
    told = name.replace("ß", "\\xdf")
    assert ran.stderr.startswith(f"fluidwarp: Cannot read {told}")
    assert ran.stderr.endswith(
        "names of files are ascii here, which lacks some of its characters; set LC_ALL=C.UTF-8.\n"
    )
    assert not (folder / "x.png").exists()


def test_a_fit_does_not_take_the_place_of_its_recipe(folder: Path, fluidwarp: Run) -> None:
    """Whose comments would be gone, and where its handles led."""
    before = (folder / "a.toml").read_bytes()
    (folder / "link.toml").symlink_to("a.toml")
    for output in ("a.toml", "link.toml", str(folder / "a.toml")):
        ran = fluidwarp(folder, "fit", "a.toml", "-o", output)
        assert (ran.returncode, ran.stdout) == (1, "")
        assert ran.stderr == "fluidwarp: a.toml would be replaced by its own result; choose another name\n"
    assert (folder / "a.toml").read_bytes() == before


@pytest.mark.parametrize(
    "words",
    [
        ["render", "long.toml", "-o", "x.mp4"],
        ["render", "long.toml", "-o", "x.mp4", "--states", "new/states"],
        ["gallery", "-o", "new/gallery"],
    ],
    ids=["render", "states", "gallery"],
)
def test_interrupted_leaves_nothing(folder: Path, words: list[str]):
    """As a user does it: Ctrl+C in the middle of a long animation, and before anything lasting is in a folder."""
    import signal

    long = RECIPE.replace("duration = 0.2", "duration = 2000")
    if "--states" in words:  # 64 ticks, after which there is one to keep, take long
        long = long.replace("grid = 32", "grid = 512")
    (folder / "long.toml").write_text(long)
    started = subprocess.Popen(
        [sys.executable, "-m", "app", *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stderr=subprocess.PIPE,
        text=True,
    )
    before = {"a.toml", "long.toml", "cat.png"}
    asked = time.monotonic()
    while here(folder) == before and started.poll() is None:
        assert time.monotonic() < asked + 100
        time.sleep(0.02)
    started.send_signal(signal.SIGINT)
    _, told = started.communicate(timeout=60)  # of a job of hours
    assert started.returncode == cli.INTERRUPTED
    assert told.endswith("fluidwarp: cancelled; nothing half-written is left\n")
    # of a grid that is far finer than the picture, if it came to the first step
    assert told.count("\n") == 1 + told.count("takes long") <= 1 + ("--states" in words)
    assert here(folder) == before


@pytest.mark.skipif(sys.platform != "linux", reason="limits a process as Linux does")
@pytest.mark.parametrize(
    ("limit", "said"),
    [
        ("n 8", "fluidwarp: ffmpeg cannot be started: more files would be open than may be; allow more, as by: "),
        ("v 200000", "; this process may have 195 MB of memory (ulimit -v), which may be too little for a driver\n"),
    ],
)
def test_what_a_process_may_not_have_is_not_told_as_missing(folder: Path, limit: str, said: str):
    """Neither ffmpeg nor OpenGL, which a person would install once more."""
    words = ["python", "-c", "from app.media.ffmpeg import ask; ask()"]
    if limit.startswith("v"):
        words = ["python", "-c", "from solver.gl.device import Device; Device.headless()"]
    words[0] = sys.executable
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    limited = ["sh", "-c", f'ulimit -{limit}; exec "$@"', "sh", *words]
    ran = subprocess.run(limited, cwd=folder, env=environment, capture_output=True, text=True)
    assert said.removeprefix("fluidwarp: ") in ran.stderr


@pytest.mark.parametrize(
    "moment",
    ["while modules are loaded", "before a job has begun", "with something half done", "when the terminal is gone"],
)
def test_interrupted_before_it_does_anything_it_says_so(folder: Path, moment: str):
    import signal

    waiting = "import time; print('now', flush=True); time.sleep(100)"
    (folder / "typer.py").write_text(waiting)
    begin = "from app.start import main; main()"
    if moment == "before a job has begun":
        begin = f"import app.cli\ndef wait(**_): {waiting}\napp.cli.cli = wait\n{begin}"
    elif moment == "with something half done":
        begin = f"""import os, app.cli, app.progress
def wait(**_):
    undo = lambda: os.write(1, b"undone" + bytes([10]))  # which may come within the print of what is interrupted
    with app.progress.if_abandoned(undo): {waiting}
app.cli.cli = wait
{begin}"""
    loading = moment in ("while modules are loaded", "when the terminal is gone")
    path = os.pathsep.join([str(folder), str(ROOT)] if loading else [str(ROOT)])
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"  # behind `&` it would be ignored
    if moment == "when the terminal is gone":
        heard += "; import os; os.close(2)"
    started = subprocess.Popen(
        [sys.executable, "-c", f"{heard}\n{begin}"],
        cwd=folder if loading else ROOT,
        env=os.environ | {"PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert started.stdout is not None
    assert started.stdout.readline() == "now\n"
    started.send_signal(signal.SIGINT)
    done, told = started.communicate(timeout=60)
    said = "" if moment == "when the terminal is gone" else "fluidwarp: interrupted\n"
    assert (started.returncode, told) == (cli.INTERRUPTED, said)
    assert done == "undone\n" * (moment == "with something half done")


def test_the_window_that_is_interrupted_says_so(folder: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch):
    def interrupted(file: Path | None) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(window, "run", interrupted)
    ran = fluidwarp(folder, "edit")
    assert (ran.returncode, ran.stderr) == (cli.INTERRUPTED, "fluidwarp: interrupted\n")


STUCK = """
import hashlib, sys
from pathlib import Path
from app.media.files import replacing
from app.progress import on_terminal
with on_terminal("stuck", 1), replacing("out.png") as temporary:
    temporary.write_bytes(b"half")
    print("writing", flush=True)
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2**25)
    print("all of it", flush=True)
"""


def test_interrupted_where_nobody_asks(folder: Path):
    """In the middle of a call into C that takes many seconds: were it waited for, one would read so."""
    import signal

    before = here(folder)
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    started = subprocess.Popen(
        [sys.executable, "-c", STUCK], cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert started.stdout is not None
    assert started.stdout.readline() == b"writing\n"
    assert here(folder) != before
    started.send_signal(signal.SIGINT)
    given, told = started.communicate(timeout=60)
    assert started.returncode == cli.INTERRUPTED
    assert given == b""  # it was broken off and not waited for
    assert told == b"fluidwarp: cancelled; nothing half-written is left\n"
    assert here(folder) == before


def test_memory_does_not_grow_with_the_frames(device: Device, tmp_path: Path):
    """Resident memory from the 10th frame to the 40th, each of them 900 kB."""
    resident: list[float] = []

    def look(done: int, total: int | None) -> None:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        resident.append(pages * os.sysconf("SC_PAGE_SIZE") / 2**20)

    recipe = Recipe.parse(
        RECIPE.replace("duration = 0.2", "duration = 0.8").replace("fps = 20", "fps = 50\nsize = 640")
    )
    y, x = np.mgrid[0:480, 0:640]
    picture = Picture(np.stack([x // 3, y // 2, (x + y) // 5], axis=-1).astype(np.uint8))
    report = run(device, Job(recipe, picture, tmp_path, Outputs(tmp_path / "x.%03d.jpg")), Progress(report=look))
    assert report.frames == 41
    assert resident[39] < resident[9] + 10


def test_what_is_lost_is_told_in_a_line(folder: Path, fluidwarp: Run):
    """By every command that reads pictures, of the picture itself and of those that the recipe names."""
    wild = Image.open(folder / "cat.png")
    wild.save(folder / "pages.tif", save_all=True, append_images=[wild, wild])
    (folder / "b.toml").write_text(RECIPE.replace("cat.png", "pages.tif"))
    line = "fluidwarp: pages.tif: of its 3 pages only the first is used\n"
    ran = fluidwarp(folder, "render", "b.toml", "-o", "x.png")
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", line)
    ran = fluidwarp(folder, "render", "a.toml", "pages.tif", "cat.png", "-o", "several")
    assert ran.returncode == 0
    assert ran.stderr == f"fluidwarp: {folder / 'pages.tif'}: of its 3 pages only the first is used\n"
    mask = '[[viscosity]]\nkind = "picture"\npicture = "pages.tif"\nscale = 0.1\n'
    (folder / "c.toml").write_text(RECIPE + mask)
    assert fluidwarp(folder, "render", "c.toml", "-o", "y.png").stderr == line
    write_map(folder / "m.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    ran = fluidwarp(folder, "apply", "m.npy", "pages.tif", "-o", "z.png")
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", line)


@pytest.mark.skipif(sys.platform != "linux", reason="limits the size of files as Linux does")
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-o", "x.png", "--map", "m.exr"], r"fluidwarp: Cannot write m\.exr: .*\. x\.png is written\.\n"),
        (
            ["-o", "x.%d.png", "--stats", "s.json", "--map", "m.exr"],
            r"fluidwarp: Cannot write m\.exr: .*\. x\.%d\.png is written\.\n",
        ),
        (["-o", "x.exr", "--bits", "32"], r"fluidwarp: Cannot write x\.exr: .*[^n]\.\n"),
    ],
    ids=["a picture", "frames", "nothing"],
)
def test_of_several_results_those_that_are_written_are_told_where_one_fails(
    folder: Path, fluidwarp: Run, words: list[str], said: str
):
    """Where files may not grow beyond 9,000 bytes: a map of 64 x 48 has 12,000 or more."""
    import resource

    fluidwarp(folder, "render", "a.toml", "-o", "first.png", "--map", "first.exr")  # the driver's own files may grow
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (9_000, hard))  # Python is deaf to the signal, and hears of an error
    try:
        ran = fluidwarp(folder, "render", "a.toml", *words)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert ran.returncode == 1
    assert re.fullmatch(said, ran.stderr)
    assert {name for name in here(folder) if name[0] in "xms"} == ({"x.png"} if words[1] == "x.png" else set()) | {
        f"x.{number}.png" for number in range(5) if "%" in words[1]
    }


def test_a_map_that_shows_nothing_of_the_picture_is_told(folder: Path, fluidwarp: Run):
    nothing = "looks up nothing inside of the picture"
    for values, edges, is_told in (
        (1e30, "transparent", True), (1e30, "black", True), (1e30, "clamp", False), (0.9, "black", False),
        (-1.01, "black", True),
    ):  # fmt: skip
        write_map(folder / "m.npy", Displacement(np.full((48, 64, 2), values, np.float32) * (1, 0)))
        ran = fluidwarp(folder, "apply", "m.npy", "cat.png", "-o", "z.png", "--edges", edges)
        said = f"fluidwarp: m.npy {nothing}, which is empty then; perhaps --kind or --grid is another\n"
        assert (ran.returncode, ran.stderr) == (0, said if is_told else "")
    (folder / "b.toml").write_text('map = "m.npy"\n' + RECIPE)
    ran = fluidwarp(folder, "render", "b.toml", "-o", "z.png")
    assert (ran.returncode, f"m.npy {nothing}; give a map that does" in ran.stderr) == (0, True)
    write_map(folder / "m.0001.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    write_map(folder / "m.0002.npy", Displacement(np.full((48, 64, 2), 2, np.float32)))
    ran = fluidwarp(folder, "apply", "m.%04d.npy", "cat.png", "-o", "z.%04d.png")
    assert "1 of the maps m.%04d.npy look up nothing inside" in ran.stderr


def test_a_map_that_is_too_small_is_refused_in_words_of_its_file(folder: Path, fluidwarp: Run):
    np.save(folder / "m.npy", np.zeros((3, 4, 2), np.float32))
    (folder / "b.toml").write_text('map = "m.npy"\n' + RECIPE)
    for words in (
        ("apply", "m.npy", "cat.png", "-o", "z.png"),
        ("convert", "m.npy", "-o", "n.npy", "--invert"),
        ("render", "b.toml", "-o", "z.png"),
    ):
        ran = fluidwarp(folder, *words)
        assert ran.returncode == 1
        said = r"Cannot use \S*m\.npy: it is 4 x 3 pixels, and a side must have at least 6; make a larger one\."
        assert re.fullmatch(f"fluidwarp: {said}\n", ran.stderr)


@pytest.mark.parametrize(
    ("more", "where"),
    [('[[viscosity]]\nkind = "picture"\npicture = "gone.png"\nscale = 1\n', "viscosity"), ('map = "gone.exr"\n', "")],
)
def test_of_a_file_that_is_gone_it_is_told_that_the_recipe_names_it(
    folder: Path, fluidwarp: Run, more: str, where: str
):
    (folder / "b.toml").write_text(more + RECIPE if not where else RECIPE + more)
    ran = fluidwarp(folder, "render", "b.toml", "-o", "z.png")
    named = r"which \S*b\.toml names: there is no such file; check the name, or put it back\.\n"
    assert re.fullmatch(rf"fluidwarp: {where}.*Cannot read \S*gone\.\w+, {named}", ran.stderr)


def test_of_a_clip_a_still_shows_the_first_frame_also_through_a_map(folder: Path, fluidwarp: Run):
    assert fluidwarp(folder, "render", "a.toml", "-o", "take.mkv").returncode == 0
    write_map(folder / "m.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    ran = fluidwarp(folder, "apply", "m.npy", "take.mkv", "-o", "z.png")
    assert (ran.returncode, ran.stderr) == (0, "fluidwarp: take.mkv: of its frames only the first is used\n")
    shown = read_picture(folder / "z.png").pixels
    assert fluidwarp(folder, "apply", "m.npy", "take.mkv", "-o", "y.%d.png").returncode == 0
    np.testing.assert_array_equal(shown, read_picture(folder / "y.0.png").pixels)


@pytest.mark.parametrize("name", ["http://example.org/a.png", "https://example.org", "file:///a.png"])
def test_an_address_as_the_first_word_is_told_as_that(folder: Path, fluidwarp: Run, name: str):
    ran = fluidwarp(folder, name)
    said = f"fluidwarp: Cannot read {name}: it is an address, and only files are read; download it first.\n"
    assert (ran.returncode, ran.stderr) == (1, said)


def test_a_fold_is_told(folder: Path, fluidwarp: Run):
    values = np.zeros((48, 64, 2), np.float32)
    values[:, 32:, 0] = -0.1
    write_map(folder / "m.npy", Displacement(values))
    ran = fluidwarp(folder, "apply", "m.npy", "cat.png", "-o", "z.png")
    assert (ran.returncode, ran.stderr) == (0, "fluidwarp: m.npy folds over itself in 96 of its pixels\n")
    (folder / "b.toml").write_text('map = "m.npy"\n' + RECIPE)
    ran = fluidwarp(folder, "render", "b.toml", "-o", "z.png")
    first, second = ran.stderr.splitlines()
    assert first == "fluidwarp: m.npy folds over itself in 96 of its pixels"
    assert re.fullmatch(r"fluidwarp: the warp folds over itself in \d+ of \d+ places", second)
    ran = fluidwarp(folder, "convert", "m.npy", "-o", "n.npy")
    assert ran.stderr == ""
    ran = fluidwarp(folder, "convert", "m.npy", "-o", "n.npy", "--invert")
    assert ran.stderr == "fluidwarp: m.npy folds over itself in 96 of its pixels, where it has no inverse\n"
    write_map(folder / "m.0007.npy", Displacement(values * 0))
    write_map(folder / "m.0008.npy", Displacement(values))
    ran = fluidwarp(folder, "apply", "m.%04d.npy", "cat.png", "-o", "z.%04d.png")
    assert ran.stderr == "fluidwarp: folds in 1 of the maps m.%04d.npy, the worst in 96 of its pixels\n"


def test_a_map_is_turned_round(folder: Path, fluidwarp: Run):
    """What is looked up at x + D(x) goes from there to x, by -D(x)."""
    x = (np.arange(64) + 0.5) / 64
    values = np.zeros((48, 64, 2), np.float32)
    values[..., 0] = moved = 0.4 * x * (1 - x)
    write_map(folder / "m.npy", Displacement(values))
    ran = fluidwarp(folder, "convert", "m.npy", "-o", "n.npy", "--invert")
    assert (ran.returncode, ran.stderr) == (0, "")
    turned = read_map(folder / "n.npy").values
    np.testing.assert_allclose(turned[:, 4:-4, 0], np.tile(np.interp(x, x + moved, -moved)[4:-4], (48, 1)), atol=1e-3)
    np.testing.assert_allclose(turned[..., 1], 0, atol=1e-5)
    # What the map of a file says of its direction is turned round with it, and back.
    write_map(folder / "m.exr", Displacement(values))
    for name, other, forward in (("m.exr", "n.exr", True), ("n.exr", "o.exr", False)):
        assert fluidwarp(folder, "convert", name, "-o", other, "--invert").returncode == 0
        assert read_map(folder / other).forward is forward
    for name in ("m.exr", "n.exr"):
        assert fluidwarp(folder, "apply", name, "cat.png", "-o", f"{name}.png").returncode == 0
    found, wanted = (read_picture(folder / f"{name}.png").pixels.astype(float) for name in ("n.exr", "m.exr"))
    assert np.abs(found - wanted)[:, 4:-4].mean() < 0.5


def test_a_clip_that_is_cut_during_the_job_is_a_failure_with_its_own_status(
    folder: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch
):
    from app.media.ffmpeg import executable

    noise = ["-f", "lavfi", "-i", "nullsrc=s=320x240:r=10:d=4,geq=random(1)*255", "-c:v", "mjpeg", "-q:v", "2"]
    subprocess.run([executable(), "-v", "error", *noise, str(folder / "in.mkv")], check=True)
    whole, advance = (folder / "in.mkv").stat().st_size, Progress.advance

    def cutting(progress: Progress, *given: int) -> None:
        """After the first frame, when a few more are read in advance."""
        os.truncate(folder / "in.mkv", whole // 2)
        advance(progress, *given)

    monkeypatch.setattr(Progress, "advance", cutting)
    ran = fluidwarp(folder, "render", "a.toml", "in.mkv", "-o", "out.mkv", "--grid", "32")
    assert ran.returncode == 65
    assert "in.mkv: it changed while it was read" in ran.stderr
    assert len(ran.stderr.splitlines()) == 1
    assert here(folder) == {"a.toml", "cat.png", "in.mkv"}


@pytest.mark.parametrize("where", ["x.png", "out/"])
def test_a_grid_far_finer_than_the_picture_is_told_once(fluidwarp: Run, folder: Path, where: str) -> None:
    ran = fluidwarp(folder, "render", "a.toml", "cat.png", "-o", where, "--grid", "400", "--duration", "0.02")
    assert ran.returncode == 0
    assert ran.stderr.count("a grid of 400 cells is 6.25 times as fine") == len(ran.stderr.splitlines()) == 1


@pytest.mark.parametrize("words", [["render", "a.toml"], ["apply", "m.npy", "cat.png"]])
def test_a_result_of_more_pixels_than_are_read_is_refused(fluidwarp: Run, folder: Path, words: list[str]) -> None:
    ran = fluidwarp(folder, *words, "-o", "x.png", "--size", "32768")
    assert ran.returncode
    assert re.search(r"--size.* asks for a result of \d+ x \d+ pixels, and at most 400000000 are made", ran.stderr)
    assert not (folder / "x.png").exists()


@pytest.mark.parametrize("words", [["render", "a.toml", "-o", "x.png"], ["apply", "m.npy", "cat.png", "-o", "x.png"]])
def test_a_limit_below_one_pixel_is_refused(folder: Path, fluidwarp: Run, words: list[str]):
    for limit in ("-1", "0"):
        ran = fluidwarp(folder, *words, "--max-pixels", limit)
        assert ran.returncode == 2
        assert "--max-pixels" in ran.stderr


def test_where_the_window_cannot_be_loaded_it_is_what_is_missing_that_is_told(
    folder: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setitem(sys.modules, "app.ui.window", None)
    for words in (["edit"], ["cat.png"]):
        ran = fluidwarp(folder, *words)
        assert (ran.returncode, ran.stdout, len(ran.stderr.splitlines())) == (2, "", 1)
        assert ran.stderr.startswith("fluidwarp: the window cannot be loaded (")
        assert ran.stderr.endswith("`fluidwarp doctor` says what is missing\n")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["m.npy", "wide.png", "-o", "x.webp"], "the result is 16384 x 8 pixels, and WebP holds no side longer"),
        (["n.npy", "cat.png", "-o", "x.webp", "--size", "20000"], "WebP holds no side longer than 16383"),
        (["n.npy", "cat.png", "-o", "x.mp4", "--size", "20000"], "h264 holds no more than 16384 x 16384"),
    ],
)
def test_a_picture_too_wide_is_refused_before_it_is_warped(
    folder: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch, words: list[str], told: str
):
    monkeypatch.setattr("app.work.apply_job.MapSampler", lambda *given: pytest.fail("it is being warped"))
    write_picture(folder / "wide.png", Picture(np.zeros((8, 16384, 3), np.uint8)))
    write_map(folder / "m.npy", Displacement(np.zeros((8, 16384, 2), np.float32)))
    write_map(folder / "n.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    ran = fluidwarp(folder, "apply", *words)
    assert (ran.returncode, len(ran.stderr.splitlines())) == (1, 1)
    assert told in ran.stderr


def test_two_results_that_a_link_makes_one_file_are_refused(folder: Path, fluidwarp: Run):
    (folder / "dog.png").write_bytes((folder / "cat.png").read_bytes())
    (folder / "out").mkdir()
    (folder / "out" / "dog.png").symlink_to("cat.png")
    ran = fluidwarp(folder, "render", "a.toml", "cat.png", "dog.png", "-o", "out")
    assert (ran.returncode, len(ran.stderr.splitlines())) == (1, 1)
    assert "cat.png and dog.png would both become" in ran.stderr
    assert here(folder / "out") == {"dog.png"}


def test_a_map_that_does_not_fit_into_the_memory_is_told_with_its_size(
    folder: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch
):
    def full(*given: object, **named: object) -> Displacement:
        raise MemoryError

    monkeypatch.setattr("app.work.export.displacement", full)
    ran = fluidwarp(folder, "render", "a.toml", "--map", "m.exr", "--map-size", "100", "--overscan", "7")
    told = "there is not enough memory for a map of 114 x 89 pixels; lower --map-size or --overscan"
    assert (ran.returncode, ran.stderr) == (1, f"fluidwarp: {told}\n")
    assert "m.exr" not in here(folder)


def test_primaries_that_a_format_cannot_tell_are_told(folder: Path, fluidwarp: Run):
    primaries = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)
    write_picture(folder / "aces.exr", Picture(np.ones((48, 64, 3), np.float32), chromaticities=primaries))
    ran = fluidwarp(folder, "render", "a.toml", "aces.exr", "-o", "x.tif")
    assert ran.stderr == (
        "fluidwarp: x.tif cannot tell the primaries (chromaticities) of the picture, and is read as BT.709; "
        "write .exr to keep it\n"
    )
    assert fluidwarp(folder, "render", "a.toml", "aces.exr", "-o", "x.exr").stderr == ""


@pytest.mark.parametrize("words", [["render", "a.toml"], ["apply", "m.npy"]])
def test_dots_per_inch_that_a_jpeg_cannot_tell_are_told(folder: Path, fluidwarp: Run, words: list[str]):
    write_picture(folder / "p.tif", Picture(np.zeros((48, 64, 3), np.uint8), dpi=(72.5, 72.5)))
    write_map(folder / "m.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    told = "fluidwarp: x.jpg says 72 dpi and not 72.5 as the picture: JPEG holds whole numbers; write .png to keep it\n"
    for more, said in ([], told), (["--strip"], ""), (["--dpi", "300"], ""):
        ran = fluidwarp(folder, *words, "p.tif", "-o", "x.jpg", *more)
        assert (ran.returncode, ran.stderr) == (0, said)


def options() -> Iterator[str]:
    """Each command, and for each of its words how it is called, what it takes, and what it is where it is left out."""
    for command in cli.cli.registered_commands:
        assert command.callback is not None
        yield f"{command.name or command.callback.__name__}:"
        for word in signature(command.callback, eval_str=True).parameters.values():
            takes, how = get_args(word.annotation)
            bounds = "".join(f", {end} {getattr(how, end)}" for end in ("min", "max") if getattr(how, end) is not None)
            names = [name for name in (how.default, *(how.param_decls or ())) if isinstance(name, str)] or [word.name]
            default = "needed" if word.default is word.empty else word.default
            yield f"  {' '.join(names)}: {takes if get_args(takes) else takes.__name__}{bounds}; {default}"


def test_every_word_of_the_command_line_takes_what_it_did():
    """Other programs call it: what changes here is told in the changelog."""
    assert [*options()] == (ROOT / "tests/golden/commands.txt").read_text("utf-8").splitlines()


WORDS = {
    "kind": Kind, "grid": PixelPlaces, "edges": Recipe.model_fields["edges"].annotation,
    "filter_": type(Recipe().output).model_fields["filter"].annotation,
    "solver": type(Recipe().fluid).model_fields["solver"].annotation,
}  # fmt: skip


def test_the_help_of_a_choice_names_what_can_be_chosen():
    found = set[str]()
    for command in cli.cli.registered_commands:
        assert command.callback is not None
        for word in signature(command.callback, eval_str=True).parameters.values():
            takes, how = get_args(word.annotation)
            if word.name in WORDS and takes in (str, str | None):
                named = set(re.findall(r"[\w-]+", how.help))
                assert not set(get_args(WORDS[word.name])) - named, (command.callback.__name__, how.help)
                found.add(word.name)
    assert found == set(WORDS)


def test_where_standard_output_and_errors_are_closed_it_works_all_the_same(
    tmp_path: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A daemon may have closed them."""
    write_picture(tmp_path / "a.png", Picture(np.zeros((16, 24, 3), np.uint8)))
    (tmp_path / "a.toml").write_text('version = 5\npicture = "a.png"\nduration = 0.05\nfluid.grid = 16\n')
    for name in ("stdout", "stderr"):
        monkeypatch.setattr(sys, name, None)
    assert fluidwarp(tmp_path, "render", "a.toml", "-o", "b.png").returncode == 0
    assert (tmp_path / "b.png").exists()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no such device")
def test_what_prints_into_a_full_disk_and_where_the_folder_is_gone_a_sentence_says_so(tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}

    def said(words: list[str], **named: Any) -> tuple[int, str]:
        ran = subprocess.run(words, stderr=subprocess.PIPE, text=True, env=environment, **named)
        return ran.returncode, ran.stderr

    program = f"{sys.executable} -m app"
    with open("/dev/full", "w") as full:
        status, told = said([*program.split(), "doctor"], cwd=tmp_path, stdout=full)
    assert (status, told) == (1, "fluidwarp: what this prints cannot be written: the disk is full; free some space\n")
    gone = f"mkdir gone && cd gone && rmdir ../gone && exec {program} render a.toml -o b.png"
    status, told = said(["sh", "-c", gone], cwd=tmp_path)
    assert (status, told) == (1, "fluidwarp: the folder that this runs in is gone; go to another one\n")


class ContextError(Exception):
    """Known by its name, as that of the solver is, which is not loaded for it."""


WHERE = "FLUIDWARP_TRACEBACK=1 shows where"
ENDS: list[tuple[BaseException, int, str]] = [
    (UserError("a.png is gone"), 1, "a.png is gone"),
    (UserError("a.mp4 has changed", 65, "in the window's words"), 65, "a.mp4 has changed"),
    (Cancelled(), 130, "cancelled; nothing half-written is left"),
    (KeyboardInterrupt(), 130, "interrupted"),
    (MemoryError(), 1, "there is not enough memory; try a smaller --size or --grid"),
    (ContextError("no OpenGL"), 1, "no OpenGL; `fluidwarp doctor` tells more"),
    (RuntimeError(), BUG, f"this is a bug in fluidwarp (RuntimeError); {WHERE}"),
    (KeyError("a"), BUG, f"this is a bug in fluidwarp (KeyError: 'a'); {WHERE}"),
    (ValueError(" first\nsecond"), BUG, f"this is a bug in fluidwarp (ValueError: first); {WHERE}"),
    (OSError(errno.EIO, "no disk"), BUG, f"this is a bug in fluidwarp (OSError: [Errno {errno.EIO}] no disk); {WHERE}"),
]  # fmt: skip


@pytest.mark.parametrize(("error", "status", "said"), ENDS, ids=lambda of: type(of).__name__)
def test_whatever_goes_wrong_ends_in_one_sentence_and_a_status(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], error: BaseException, status: int, said: str
):
    def broken(**_: object) -> None:
        raise error

    monkeypatch.setattr("app.cli.cli", broken)
    monkeypatch.setattr(sys, "argv", ["fluidwarp", "render"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert (ended.value.code, *capfd.readouterr()) == (status, "", f"fluidwarp: {said}\n")
    if status == BUG:
        monkeypatch.setenv("FLUIDWARP_TRACEBACK", "1")
        with pytest.raises(type(error)) as raised:
            cli.main()
        assert raised.value is error


@pytest.mark.parametrize(("status", "ended"), [(None, 0), (0, 0), (1, 1), (3, 3)])
def test_the_status_of_a_command_is_that_of_the_process(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], status: int | None, ended: int
):
    monkeypatch.setattr("app.cli.cli", lambda **_: status)
    monkeypatch.setattr(sys, "argv", ["fluidwarp", "doctor"])
    with pytest.raises(SystemExit) as found:
        cli.main()
    assert (found.value.code or 0, capfd.readouterr().err) == (ended, "")


def test_an_interrupt_that_typer_has_made_a_status_of_is_told(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    monkeypatch.setattr("app.cli.cli", lambda **_: cli.INTERRUPTED)
    monkeypatch.setattr(sys, "argv", ["fluidwarp", "doctor"])
    with pytest.raises(SystemExit) as found:
        cli.main()
    assert (found.value.code, capfd.readouterr().err) == (cli.INTERRUPTED, "fluidwarp: interrupted\n")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no such device")
def test_what_is_printed_where_nobody_reads_or_nothing_fits_is_no_mistake_of_ours(tmp_path: Path):
    """As `| head` reads no further; also where Python keeps what is printed until the end."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    reading, writing = os.pipe()
    os.close(reading)
    with open(writing, "wb") as closed, open("/dev/full", "wb") as full, open(os.devnull, "rb") as unwritable:
        for output, said in (
            (closed, ""),
            (full, "fluidwarp: what this prints cannot be written: the disk is full; free some space\n"),
            (
                unwritable,
                "fluidwarp: what this prints cannot be written: its output is open for reading only; "
                "check what it is redirected to\n",
            ),
        ):
            ran = subprocess.run(
                [sys.executable, "-m", "app", "--version"],
                cwd=tmp_path,
                env=environment | {"PYTHONPATH": str(ROOT)},
                stdout=output,
                stderr=subprocess.PIPE,
                text=True,
            )
            assert (ran.returncode, ran.stderr) == (1, said)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no such device")
def test_what_cannot_be_told_costs_no_picture_and_no_status(tmp_path: Path):
    """Also what is told before a picture is begun, as that its grid is far too fine."""
    push = '[[stroke]]\ntool = "push"\nradius = 0.3\nsamples = [[0, 0.3, 0.5, 1.0]]\n'
    (tmp_path / "fine.toml").write_text(f"version = 5\nduration = 0.1\n[fluid]\ngrid = 388\ndt = 0.1\n{push}")
    for name in ("a.png", "b.png"):
        write_picture(tmp_path / name, Picture(np.zeros((12, 16, 3), np.uint8)))
    with open("/dev/full", "wb") as full:
        for words, status in ((["rendr"], 2), (["render", "fine.toml", "a.png", "b.png", "-o", "out"], 0)):
            environment = os.environ | {"PYTHONPATH": str(ROOT)}
            command = [sys.executable, "-m", "app", *words]
            assert subprocess.run(command, cwd=tmp_path, env=environment, stderr=full).returncode == status
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == ["a.png", "b.png"]


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (["rendr"], 2, "rendr is neither a file nor a command; the commands are "),
        (["a.toml"], 1, "a.toml does not exist; check the name of the picture, clip, recipe or project"),
        (["here/there"], 1, "here/there does not exist; check the name of the picture, clip, recipe or project"),
        (["f.%04d.png"], 0, ""),
        (["cat.png", "dog.png"], 2, "got unexpected extra argument"),
        (["render", ""], 1, "one of the words of this command is empty; is a variable in it not set?"),
    ],
)
def test_a_first_word_that_is_no_command_is_a_file_or_refused(
    tmp_path: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch, words: list[str], status: int, said: str
):
    (tmp_path / "cat.png").touch()
    opened: list[Path | None] = []
    monkeypatch.setattr(window, "run", opened.append)
    ran = fluidwarp(tmp_path, *words)
    assert (ran.returncode, ran.stdout, ran.stderr.count("\n")) == (status, "", 1 if said else 0)
    assert ran.stderr.startswith(f"fluidwarp: {said}" if said else "")
    assert opened == ([] if said else [Path(words[0])])
    if words == ["rendr"]:
        assert ran.stderr.endswith("the commands are edit, render, fit, apply, convert, gallery, doctor\n")


def test_the_version_is_that_which_is_installed(tmp_path: Path, fluidwarp: Run):
    said = f"fluidwarp {metadata.version('fluidwarp')}\n"
    ran = fluidwarp(tmp_path, "--version")
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, said, "")
    ran = fluidwarp(tmp_path, "--version", "render")  # which is not asked for alone, and so by typer
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, said, "")
