"""Imports run one way, without a circle, and load no more than they say; tests use nothing private."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FOLDERS = ("shaders", "solver", "app", "assets")
# Each room and the rooms that it may look into besides itself, in an order without circles.
ROOMS = {
    "shaders": set[str](),
    "assets": set[str](),
    "solver.limits": set[str](),
    "solver.components": set[str](),
    "solver.course": set[str](),
    "solver.grid": {"solver.limits"},
    "solver": {"shaders", "solver.limits", "solver.components", "solver.course", "solver.grid"},
    "app.errors": set[str](),
    "app.progress": {"app.errors"},
    "app.model": {"app.errors", "app.progress", "solver.limits", "solver.components", "solver.course", "solver.grid"},
    "app.media": {"app.errors", "app.progress", "solver.grid", "app.model"},
    "app.work": {"app.errors", "app.progress", "solver", "solver.components", "solver.grid", "app.model", "app.media"},
    "app.gallery": {"app.errors", "app.progress", "solver", "solver.grid", "app.model", "app.media", "app.work"},
    "app.ui": {"app.errors", "app.progress", "solver", "solver.grid", "app.model", "app.media", "app.work", "assets"},
    "app": {
        "app.errors",
        "app.progress",
        "solver",
        "solver.grid",
        "app.model",
        "app.media",
        "app.work",
        "app.gallery",
        "app.ui",
        "assets",
    },
}
# The same of the solver's own.
SOLVER = {
    "gl": set[str](),
    "components": set[str](),
    "course": set[str](),
    "limits": set[str](),
    "grid": {"limits"},
    "params": {"limits"},
    "packing": {"gl"},
    "pressure": {"gl", "components", "packing"},
    "viscosity": {"gl", "components", "packing", "params"},
    "state": {"gl", "grid"},
    "faces": {"gl", "limits", "grid"},
    "scheme": {"gl", "limits", "grid", "params", "state", "faces"},
    "flow": {"gl", "limits", "grid", "params"},
    "steepness": {"gl"},
    "trace": {"gl", "grid", "params", "steepness"},
    "advection": {"gl", "params", "packing"},
    "energy": {"gl", "limits", "packing"},
    "fluid": {
        *("gl", "limits", "grid", "params", "packing", "pressure", "viscosity"),
        *("state", "faces", "scheme", "flow", "steepness", "trace", "advection", "energy"),
    },
    "warp": {"gl", "limits", "grid", "params", "state", "faces", "scheme", "steepness", "trace", "fluid"},
    "paper": {"gl", "limits", "grid", "params", "faces", "scheme", "warp"},
    "brush": {"gl", "course", "limits", "grid", "state", "faces", "scheme", "warp"},
    "resample": {"gl", "warp"},
}
TOOLKITS = {"glfw", "imgui_bundle"}
CODECS = {"imageio", "imageio_ffmpeg", "av", "PIL", "tifffile", "imagecodecs", "OpenEXR"}


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


MODULES = {module_of(path): path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))}


def is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text("utf-8"))


def walk(node: ast.AST, types: bool) -> Iterator[ast.AST]:
    """All nodes below one; without `types`, none of what only a type checker sees."""
    for child in ast.iter_child_nodes(node):
        if types or not is_for_types(child):
            yield child
            yield from walk(child, types)


def imported(path: Path, types: bool = True) -> Iterator[str]:
    """The dotted names of all that a source file imports, wherever in it."""
    for node in walk(tree(path), types):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def room_of(name: str) -> str | None:
    """The room that a module, or a name in it, is in; None if it is not ours."""
    parts = name.split(".")
    return next((room for room in (".".join(parts[:2]), parts[0]) if room in ROOMS), None)


def within(name: str) -> str:
    """The module of ours that a dotted name is, or is in."""
    while name not in MODULES:
        name = name.rpartition(".")[0]
    return name


def circles(types: bool) -> list[set[str]]:
    """Which of our modules import each other in circles, by whatever imports, each circle as large as it is."""
    reached = {
        name: {within(other) for other in imported(path, types) if room_of(other)} for name, path in MODULES.items()
    }
    for middle in MODULES:  # Warshall's transitive closure
        for others in reached.values():
            if middle in others:
                others |= reached[middle]
    found: list[set[str]] = []
    for name in MODULES:
        circle = {other for other in reached[name] if name in reached[other]}
        if circle and circle not in found:
            found.append(circle)
    return found


@pytest.mark.parametrize("name", MODULES)
def test_a_room_looks_one_way(name: str):
    room = room_of(name)
    assert room is not None
    for other in imported(MODULES[name]):
        looked_into = room_of(other)
        assert looked_into in {room, None, *ROOMS[room]} or room == "assets", f"{name} imports {other}"
        assert room == "app.ui" or other.split(".")[0] not in TOOLKITS, f"{name} imports {other}"


def test_the_model_knows_numbers_and_text_only():
    for name, path in MODULES.items():
        if room_of(name) == "app.model":
            tops = {other.split(".")[0] for other in imported(path)} - {"app", "solver", *sys.stdlib_module_names}
            assert tops <= {"numpy", "pydantic", "pydantic_core", "tomlkit"}, name


@pytest.mark.parametrize("types", [False, True], ids=["when run", "for the type checker too"])
def test_no_modules_import_each_other_in_a_circle(types: bool):
    assert circles(types) == []


def test_the_rooms_of_the_solver_look_one_way():
    for path in (ROOT / "solver").rglob("*.py"):
        room = path.relative_to(ROOT / "solver").parts[0].removesuffix(".py")
        if room == "__init__":
            continue
        for name in imported(path):
            if name.startswith("solver."):
                assert name.split(".")[1] in {room, *SOLVER[room]}, f"{path} imports {name}"


@pytest.mark.parametrize("rooms", [ROOMS, SOLVER], ids=["app", "solver"])
def test_the_rooms_are_in_order(rooms: dict[str, set[str]]):
    passed: set[str] = set()
    for room, others in rooms.items():
        assert others <= passed, f"{room} looks into what comes after it"
        passed.add(room)


def test_every_room_is_told():
    names = {path.name.removesuffix(".py") for path in (ROOT / "solver").iterdir()}
    assert set(SOLVER) == {name for name in names if not name.startswith("__") and not name.endswith((".md", ".typed"))}
    inside = {f"app.{path.parent.name}" for path in (ROOT / "app").glob("*/__init__.py")}
    assert inside <= set(ROOMS)


def test_only_the_window_is_imported_by_name():
    """What of `app` imports `app.ui` does so inside a function, where the window is opened."""
    for name, path in MODULES.items():
        if room_of(name) == "app":
            for node in tree(path).body:
                if isinstance(node, ast.ImportFrom):
                    assert not (node.module or "").startswith("app.ui"), f"{name} imports {node.module}"


def private(path: Path) -> Iterator[str]:
    """What a source file uses that is private to others: attributes, imports, and names that it hands to setattr."""
    for node in ast.walk(tree(path)):
        if not isinstance(node, ast.Attribute | ast.ImportFrom | ast.Call):  # of most nodes, what comes now is slow
            continue
        match node:
            case ast.Attribute(value=ast.Name("self" | "cls")):
                names = []
            case ast.Attribute(attr=name):
                names = [name]
            case ast.ImportFrom(names=aliases):
                names = [alias.name for alias in aliases]
            case ast.Call(func=ast.Name(of) | ast.Attribute(attr=of), args=[_, ast.Constant(str(name)), *_]):
                names = [name.rpartition(".")[2]] if of in ("getattr", "setattr", "delattr", "hasattr") else []
            case ast.Call(func=ast.Attribute(attr="setattr"), args=[ast.Constant(str(name)), *_]):
                names = [name.rpartition(".")[2]]
            case _:
                names = []
        yield from (
            f"{name}, line {getattr(node, 'lineno', 0)}"
            for name in names
            if name.startswith("_") and not name.startswith("__")
        )


PRIVATE = """
import os
from some import _hidden
class Own:
    def __init__(self, other): self._mine = other.__class__
def uses(thing, monkeypatch):
    thing._part.read()
    getattr(thing, "_word")
    monkeypatch.setattr(thing, "_word", 1)
    monkeypatch.setattr("some.module._word", 1)
"""


def test_no_test_uses_what_is_private_to_others(tmp_path: Path):
    (tmp_path / "some.py").write_text(PRIVATE)
    assert sorted(private(tmp_path / "some.py")) == [
        "_hidden, line 3",
        "_part, line 7",
        "_word, line 10",
        "_word, line 8",
        "_word, line 9",
    ]
    assert {path.name: found for path in (ROOT / "tests").rglob("*.py") if (found := [*private(path)])} == {}


def loaded_by(code: str) -> set[str]:
    """The top-level modules that a fresh interpreter has loaded after `code`."""
    code += "\nimport sys\nprint(*{name.split('.')[0] for name in sys.modules})"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    return set(ran.stdout.split())


def test_the_model_loads_no_gl_no_codec_and_no_window():
    names = ", ".join(name for name in MODULES if room_of(name) == "app.model")
    assert not loaded_by(f"import {names}") & {"moderngl", *CODECS, *TOOLKITS}


def test_media_loads_no_gl_and_no_window():
    names = ", ".join(name for name in MODULES if room_of(name) == "app.media")
    assert not loaded_by(f"import {names}") & {"moderngl", *TOOLKITS}


def test_the_command_line_is_quick_to_load():
    assert not loaded_by("import app.cli") & {"moderngl", "numpy", "pydantic", "PIL", "rich", *TOOLKITS}


def test_rendering_loads_no_window():
    code = """
import numpy as np
from app.media.auxiliary import Pictures
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.work.replay import Replay
from solver.gl.device import Device
with Device.headless() as device:
    replay = Replay(device, Recipe.parse("[fluid]\\ngrid = 16"), Pictures(Picture(np.zeros((8, 8, 3), np.uint8))))
    replay.seek(2)
    replay.release()
"""
    modules = loaded_by(code)
    assert "moderngl" in modules
    assert not modules & TOOLKITS
