"""Every option of the command line changes its own part of the order and nothing else; other values are refused."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import is_dataclass
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app import cli
from app.errors import UserError
from app.media.displacement import Displacement
from app.media.maps import write_map
from app.media.pictures import write_picture
from app.model.picture import Picture
from app.progress import Progress
from app.work import apply_job, batch
from app.work.apply_job import Application
from app.work.fit_job import FitJob
from app.work.tasks import Task
from solver.gl.context import GPU
from support.commands import Run

OUTPUTS: dict[str, tuple[str, dict[str, Any]]] = {
    "output": ("-o y.tif", {"outputs.file": Path("y.tif")}),
    "frames": ("--frames 3-5", {"outputs.part": (3, 5)}),
    "resume": ("--resume", {"outputs.resume": True}),
    "codec": ("--codec piz", {"outputs.codec": "piz"}),
    "bits": ("--bits 16", {"outputs.bits": 16}),
    "dpi": ("--dpi 72.5", {"outputs.dpi": 72.5}),
    "strip": ("--strip", {"outputs.strip": True}),
    "max_pixels": ("--max-pixels 5000", {"max_pixels": 5000}),
    "gpu": ("--gpu 3", {GPU: "3"}),
}
MANY = {
    "jobs": ("--jobs 4", {"jobs": 4}),
    "cluster": ("--cluster tcp://a:1", {"cluster": "tcp://a:1"}),
}
MAP: dict[str, tuple[str, dict[str, Any]]] = {
    "kind": ("--kind offsets", {"maps.kind": "offsets"}),
    "grid": ("--grid pixels", {"maps.grid": "pixels"}),
    "overscan": ("--overscan 3", {"maps.overscan": 3}),
    "max_pixels": ("--max-pixels 5000", {"maps.max_pixels": 5000}),
    "gpu": ("--gpu 3", {GPU: "3"}),
}
TABLES = {
    "fluid": ("grid", "solver"), "output": ("size", "fps", "quality", "filter"), "time": ("start", "end"),
}  # fmt: skip
EDITS = {
    "size": 60, "filter_": "nearest", "grid": 24, "solver": "paper", "duration": 0.5, "amount": 0.75, "fps": 12.5,
    "quality": 42, "start": 0.25, "end": 0.75,
}  # fmt: skip
FLAGS = {"filter_": "--filter", "start": "--from", "end": "--to"}


def edit(name: str, value: object) -> tuple[str, dict[str, Any]]:
    key = name.rstrip("_")
    table = next((f"{table}." for table, keys in TABLES.items() if key in keys), "")
    return f"{FLAGS.get(name, f'--{name}')} {value}", {f"edits.{table}{key}": value}


WAYS: dict[str, tuple[str, dict[str, tuple[str, dict[str, Any]]]]] = {
    "render": (
        "a.toml -o x.exr --map m.npy",
        OUTPUTS
        | {name: edit(name, value) for name, value in EDITS.items()}
        | {
            "recipe": ("", {}),
            "pictures": ("cat.png", {"picture": Path("cat.png")}),
            "image": ("--image cat.png", {"picture": Path("cat.png")}),
            "stats": ("--stats s.json", {"outputs.stats": Path("s.json")}),
            "map_": ("--map n.npy", {"outputs.maps.path": Path("n.npy")}),
            "forward": ("--forward", {"outputs.maps.forward": True}),
            "offsets": ("--offsets", {"outputs.maps.kind": "offsets"}),
            "overscan": ("--overscan 3", {"outputs.maps.overscan": 3}),
            "map_size": ("--map-size 90", {"outputs.maps.size": 90}),
            "states": ("--states kept", {"outputs.states": Path("kept")}),
            "animated": ("--animated", {"outputs.animated": True}),
        },
    ),
    "apply": (
        "m.npy cat.png -o x.exr",
        OUTPUTS
        | MAP
        | {
            "map_": ("", {}),
            "pictures": ("", {}),
            "edges": ("--edges wrap", {"edges": "wrap"}),
            "size": ("--size 60", {"size": 60}),
            "filter_": ("--filter nearest", {"filter": "nearest"}),
            "fps": ("--fps 12.5", {"fps": 12.5}),
            "quality": ("--quality 42", {"quality": 42}),
            "max_pixels": ("--max-pixels 5000", {"max_pixels": 5000, "maps.max_pixels": 5000}),
        },
    ),
    "fit": (
        "a.toml -o x.toml",
        {
            "recipe": ("", {}),
            "output": ("-o y.toml", {"output": Path("y.toml")}),
            "pairs": ("--pairs a.csv --pairs b.pts", {"pairs": (Path("a.csv"), Path("b.pts"))}),
            "masks": ("--masks cat.png dog.png", {"masks": (Path("cat.png"), Path("dog.png"))}),
            "arrived": ("--arrived q.csv", {"arrived": Path("q.csv")}),
            "image": ("--image cat.png", {"image": Path("cat.png")}),
            "evaluations": ("--evaluations 7", {"evaluations": 7}),
            "local": ("--local 0.25", {"local": 0.25}),
            "time_limit": ("--time-limit 0", {"is stopped": True}),
            "max_pixels": ("--max-pixels 5000", {"max_pixels": 5000}),
            "gpu": ("--gpu 3", {GPU: "3"}),
        },
    ),
    "convert": (
        "m.npy -o x.exr",
        MAP
        | {
            "map_": ("", {}),
            "output": ("-o y.tif", {"output": Path("y.tif")}),
            "offsets": ("--offsets", {"kind": "offsets"}),
            "invert": ("--invert", {"invert": True}),
        },
    ),
}
"""Of each command: words that are enough for it, and for each of its parameters more words, with the fields of the
order that these change."""

SEVERAL = {"render": "a.toml cat.png dog.png -o out", "apply": "m.npy cat.png dog.png -o out"}


def flat(order: object, above: str = "") -> dict[str, Any]:
    """The fields of an order by their names; those of a part have the name of that part before theirs."""
    found: dict[str, Any] = {}
    for name, value in (order if isinstance(order, dict) else vars(order)).items():
        is_part = is_dataclass(value) or isinstance(value, dict)
        found |= flat(value, f"{above}{name}.") if is_part else {f"{above}{name}": value}
    return found


@pytest.fixture
def asked(tmp_path: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], dict[str, Any]]:
    """The order that a command line gives, as `flat` has it; nothing of it is carried out."""
    write_picture(tmp_path / "cat.png", Picture(np.zeros((48, 64, 3), np.uint8)))
    write_picture(tmp_path / "dog.png", Picture(np.zeros((48, 64, 3), np.uint8)))
    write_map(tmp_path / "m.npy", Displacement(np.zeros((48, 64, 2), np.float32)))
    (tmp_path / "a.toml").write_text('picture = "cat.png"\nduration = 1.0\n')
    heard: list[dict[str, Any]] = []

    def hear(order: dict[str, Any]) -> Any:
        heard.append(order | {GPU: os.environ.get(GPU)})
        raise UserError("that is all")

    def convert(source: apply_job.MapSource, output: Path, kind: str, invert: bool, progress: object) -> None:
        hear(flat(source, "maps.") | {"output": output, "kind": kind, "invert": invert})

    def several(tasks: Any, report: object, progress: object, jobs: int, cluster: str | None, *told: object) -> None:
        hear(flat(tasks[0]) | {"jobs": jobs, "cluster": cluster, "count": len(tasks)})

    def fit(job: FitJob, device: object, progress: Progress) -> None:
        hear(flat(job) | {"is stopped": progress.cancel()})

    monkeypatch.setattr(Task, "perform", lambda task, device, progress: hear(flat(task)))
    monkeypatch.setattr(Application, "perform", lambda order, device, progress: hear(flat(order)))
    monkeypatch.setattr(FitJob, "perform", fit)
    monkeypatch.setattr(apply_job, "converted", convert)
    monkeypatch.setattr(batch, "run_batch", several)

    def ask(line: str) -> dict[str, Any]:
        monkeypatch.setenv(GPU, "")  # so that what the command line sets is undone after the test
        monkeypatch.delenv(GPU)
        ran = fluidwarp(tmp_path, *line.split())
        assert (ran.returncode, ran.stderr, len(heard)) == (1, "fluidwarp: that is all\n", 1), line
        return heard.pop()

    return ask


def declared(command: str) -> set[str]:
    """The names of the parameters of a command."""
    callbacks = {each.name or each.callback.__name__: each.callback for each in cli.cli.registered_commands}  # pyright: ignore[reportOptionalMemberAccess]
    return set(signature(callbacks[command]).parameters)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("command", WAYS)
def test_every_option_is_what_is_asked_for_by_it_and_nothing_else(
    command: str, asked: Callable[[str], dict[str, Any]]
) -> None:
    words, options = WAYS[command]
    assert declared(command) - {"jobs", "cluster", "verbose"} == set(options)
    plain = asked(f"{command} {words}")
    for name, (more, expected) in options.items():
        found = asked(f"{command} {words} {more}")
        assert {key: value for key, value in found.items() if value != plain[key]} == expected, (command, name)


@pytest.mark.parametrize("command", SEVERAL)
def test_several_pictures_are_handed_on_with_the_processes_that_are_asked_for(
    command: str, asked: Callable[[str], dict[str, Any]]
) -> None:
    plain = asked(f"{command} {SEVERAL[command]}")
    assert (plain["count"], plain["jobs"], plain["cluster"], plain["picture"].name) == (2, 1, None, "cat.png")
    for more, expected in MANY.values():
        found = asked(f"{command} {SEVERAL[command]} {more}")
        assert {key: value for key, value in found.items() if value != plain[key]} == expected


def test_of_a_picture_given_twice_the_first_is_that_of_the_option(asked: Callable[[str], dict[str, Any]]) -> None:
    assert asked("render a.toml dog.png --image cat.png -o out")["count"] == 2
    assert asked("render a.toml dog.png --image cat.png -o out")["picture"].name == "cat.png"


def test_without_a_name_a_recipe_becomes_out_png_or_its_map_alone(asked: Callable[[str], dict[str, Any]]) -> None:
    assert asked("render a.toml")["outputs.file"] == Path("out.png")
    assert asked("render a.toml --map m.exr")["outputs.file"] is None


@pytest.mark.parametrize(
    ("frames", "part"),
    [("0", (0, 0)), ("7", (7, 7)), ("0-99", (0, 99)), ("100-", (100, None)), ("3-3", (3, 3)), ("0-0", (0, 0)),
     ("9" * 15, (10**15 - 1, 10**15 - 1)), (f"1-{'9' * 15}", (1, 10**15 - 1))],
)  # fmt: skip
def test_a_part_is_named_by_its_first_and_last_frame(
    frames: str, part: tuple[int, int | None], asked: Callable[[str], dict[str, Any]]
) -> None:
    assert asked(f"render a.toml -o x.gif --frames {frames}")["outputs.part"] == part


@pytest.mark.parametrize(
    "frames", ["-", "-7", "a", "1-a", "a-1", "1-2-3", "2-1", "1.5", "+1", "1_0", "9" * 16, f"1-{'9' * 16}", "²", "１"]
)
def test_what_names_no_part_is_refused(tmp_path: Path, fluidwarp: Run, frames: str) -> None:
    (tmp_path / "a.toml").write_text("")
    ran = fluidwarp(tmp_path, "render", "a.toml", "-o", "x.gif", f"--frames={frames}")
    assert (ran.returncode, ran.stderr) == (1, f"fluidwarp: --frames must be like 0-99, 100- or 7, not {frames}\n")
