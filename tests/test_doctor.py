"""What `fluidwarp doctor` looks at, what it says of each thing, and how a process that is asked may end."""

from __future__ import annotations

import platform
import re
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest

from app import doctor
from app.doctor import Finding, examine
from solver.gl.context import GPU, MOST_GPUS
from support.commands import Run

ANSWERS = {
    "prints what it found": ("print('{\"a\": 1}')", {"a": 1}),
    "and complains": ("print('{\"a\": 1}'); sys.stderr.write('noise')", {"a": 1}),
    "says what is wrong": ('print(\'{"error": "no X"}\')', {"error": "no X"}),
    "and the driver too": (
        'print(\'{"error": "no X", "devices": 2}\'); sys.stderr.write(\'first\\nlast \\n\')',
        {"error": "no X; the driver says: last", "devices": 2},
    ),
    "fails": ("sys.exit(3)", {"error": "it ended with status 3"}),
    "fails with words": ("sys.exit('first\\nlast')", {"error": "last"}),
    "is killed": ("os.kill(os.getpid(), 9)", {"error": "it ended with status -9"}),
    "is told what is given": ("print(json.dumps(os.environ['GIVEN']))", "42"),
    "may complain": ("print(json.dumps(os.environ['EGL_LOG_LEVEL']))", "warning"),
}


@pytest.mark.parametrize("case", ANSWERS)
def test_what_a_process_answers_is_told_however_it_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str
) -> None:
    does, expected = ANSWERS[case]
    (tmp_path / "asked_by_a_test.py").write_text(f"import json, os, sys\n{does}\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert doctor.ask("asked_by_a_test", GIVEN="42") == expected


def test_a_process_that_hangs_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "asked_by_a_test.py").write_text("import time\ntime.sleep(100)\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(doctor, "PATIENCE", 0.1)
    assert doctor.ask("asked_by_a_test") == {"error": "no answer within 0.1 s"}


WELL = {
    "version": "4.5", "renderer": "Card", "vendor": "Maker", "max_texture_size": 8192, "max_draw_buffers": 8,
    "max_texture_units": 32, "is_software": False,
}  # fmt: skip
WINDOW = {"platform": "X11", "opengl": "3.3"}
ON_DEBIAN = "on Debian or Ubuntu: apt-get install "


def machine(
    monkeypatch: pytest.MonkeyPatch, headless: dict[str, Any], window: dict[str, Any], devices: int = 0,
    **environment: str,
) -> None:  # fmt: skip
    """Let processes answer, and the environment be, as on such a machine."""

    def answer(module: str, **given: str) -> dict[str, Any]:
        if module == "app.ui.probe":
            return window
        return {"error": "no device", "devices": devices} if given.get(GPU) == str(MOST_GPUS) else headless

    monkeypatch.setattr(doctor, "ask", answer)
    for name in (GPU, "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)


def found() -> dict[str, Finding]:
    return {one.name: one for one in examine()}


def test_all_that_is_well_is_told_with_what_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    machine(monkeypatch, WELL, WINDOW, 2, DISPLAY=":0")
    every = found()
    assert [*every] == [
        "Python", "libraries", "OpenGL without a window", "limits", "--gpu 0", "--gpu 1", "window", "video"
    ]  # fmt: skip
    assert all(one.is_well for one in every.values())
    assert every["Python"].said == f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    named = [part.split(" ") for part in every["libraries"].said.split(", ")]
    assert named == [[name, metadata.version(name)] for name in doctor.LIBRARIES]
    assert every["OpenGL without a window"].said == "4.5, Card (Maker)"
    assert every["limits"].said == "textures up to 8192 x 8192, 8 draw buffers, 32 texture units"
    assert every["--gpu 1"].said == "Card (Maker)"
    assert every["window"].said == "X11, OpenGL 3.3"
    assert every["video"].said.startswith("ffmpeg ")


def test_every_library_that_is_needed_is_looked_for() -> None:
    """But for those without which the command line does not start."""
    needed = {re.split("[>; ]", each)[0] for each in metadata.requires("fluidwarp") or () if "extra ==" not in each}
    assert sorted(doctor.LIBRARIES) == sorted(needed - {"typer", "rich"})


def test_that_no_gpu_is_used_is_told_and_is_well(monkeypatch: pytest.MonkeyPatch) -> None:
    machine(monkeypatch, WELL | {"is_software": True}, WINDOW, DISPLAY=":0")
    assert found()["speed"] == Finding("speed", "no GPU is used: everything works, at the speed of the processor")


@pytest.mark.parametrize(
    ("asked", "mend"),
    [({}, "install what is named above"), ({GPU: "7"}, "give FLUIDWARP_GPU another number, or none")],
)
def test_without_opengl_nothing_works(monkeypatch: pytest.MonkeyPatch, asked: dict[str, str], mend: str) -> None:
    machine(monkeypatch, {"error": "no OpenGL"}, WINDOW, 1, DISPLAY=":0", **asked)
    every = found()
    assert every["OpenGL without a window"] == Finding("OpenGL without a window", "no OpenGL", mend, vital=True)
    assert every["--gpu 0"] == Finding("--gpu 0", "no OpenGL", "choose another device")
    assert not every.keys() & {"limits", "speed"}


@pytest.mark.parametrize(
    ("words", "mend"),
    [
        ("cannot import imgui_bundle", ON_DEBIAN + "libx11-6 libxext6"),
        ("libX11.so.6 is not there", ON_DEBIAN + "libx11-6 libxext6"),
        ("libXext.so.6 is not there", ON_DEBIAN + "libx11-6 libxext6"),
        ("GLX: no config", ON_DEBIAN + "libgl1 libgl1-mesa-dri, or a driver with OpenGL 3.3"),
        ("cannot open it", "check that the display is there (WAYLAND_DISPLAY=w, DISPLAY=:0)"),
    ],
)
def test_of_a_window_that_cannot_be_it_is_told_what_to_install(
    monkeypatch: pytest.MonkeyPatch, words: str, mend: str
) -> None:
    machine(monkeypatch, WELL, {"error": words}, DISPLAY=":0", WAYLAND_DISPLAY="w")
    assert found()["window"] == Finding("window", words, mend)


def test_an_encoder_that_is_not_there_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    import imageio_ffmpeg

    def missing() -> str:
        raise RuntimeError("none found")

    machine(monkeypatch, WELL, WINDOW)
    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_version", missing)
    assert found()["video"] == Finding("video", "none found", "pip install --force-reinstall imageio-ffmpeg")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert not found()["video"].is_well


@pytest.mark.parametrize(
    ("headless", "libraries", "window", "status", "marks"),
    [
        (WELL, (), WINDOW, 0, "ok ok ok ok ok ok"),
        (WELL, (), {"error": "cannot open it"}, 0, "ok ok ok ok without ok"),
        ({"error": "no OpenGL"}, (), WINDOW, 1, "ok ok missing ok ok"),
        (WELL, ("no-such-library",), WINDOW, 1, "ok missing ok ok ok ok"),
    ],
)
def test_the_command_marks_what_is_missing_and_fails_for_what_is_vital(
    tmp_path: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch, headless: dict[str, Any],
    libraries: tuple[str, ...], window: dict[str, Any], status: int, marks: str,
) -> None:  # fmt: skip
    machine(monkeypatch, headless, window, DISPLAY=":0")
    monkeypatch.setattr(doctor, "LIBRARIES", (*doctor.LIBRARIES, *libraries))
    ran = fluidwarp(tmp_path, "doctor")
    assert (ran.returncode, ran.stderr) == (status, "")
    rows = [line for line in ran.stdout.splitlines() if line[1] != " "]
    assert " ".join(line.split()[0] for line in rows) == marks
    mends = [one.mend for one in examine() if one.mend]
    assert [line.strip() for line in ran.stdout.splitlines() if line[1] == " "] == mends


def test_what_a_driver_says_in_brackets_is_printed_as_it_is(
    tmp_path: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And not taken for markup."""
    machine(monkeypatch, WELL | {"renderer": "[red]Card[/]"}, {"error": "[bold]"}, DISPLAY="[/]")
    told = fluidwarp(tmp_path, "doctor").stdout
    assert all(words in told for words in ("[red]Card[/] (Maker)", "[bold]", "(DISPLAY=[/])"))
