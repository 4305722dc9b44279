"""Imports run one way: shaders <- solver <- app <- app/ui, and the model knows no GL."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
OURS = {"shaders", "solver", "app", "assets", "tests"}
MAY_IMPORT = {
    "shaders": set[str](),
    "solver": {"shaders", "solver"},
    "app": {"app", "solver", "shaders", "assets"},
    "app/ui": {"app", "solver", "shaders", "assets"},
}
# Each room of the solver and the rooms that it may look into, in an order without circles.
SOLVER = {
    "gl": set[str](),
    "grid": set[str](),
    "params": set[str](),
    "packing": {"gl"},
    "pressure": {"gl", "packing"},
    "viscosity": {"gl", "packing", "params"},
    "scheme": {"gl", "grid", "params"},
    "fluid": {"gl", "grid", "params", "packing", "pressure", "viscosity", "scheme"},
    "warp": {"gl", "grid", "scheme", "fluid"},
    "paper": {"gl", "grid", "params", "scheme", "warp"},
    "brush": {"gl", "grid", "scheme", "warp"},
    "resample": {"gl", "warp"},
}
TOOLKITS = {"glfw", "imgui_bundle"}
MODEL = ("recipe", "schema", "strokes", "forces", "handles", "masks", "timelaws", "timeline", "history", "document")


def sources(folder: str) -> list[Path]:
    found = sorted((ROOT / folder).rglob("*.py"))
    return [path for path in found if folder != "app" or "ui" not in path.relative_to(ROOT).parts]


def imported(path: Path) -> Iterator[str]:
    """The dotted names of all that a source file imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("folder", sorted(MAY_IMPORT))
def test_imports_run_one_way(folder: str):
    for path in sources(folder):
        for name in imported(path):
            top = name.split(".")[0]
            assert top not in OURS or top in MAY_IMPORT[folder], f"{path} imports {name}"
            if folder != "app/ui":
                assert top not in TOOLKITS, f"{path} imports {name}"


def test_the_rooms_of_the_solver_look_one_way():
    for path in (ROOT / "solver").rglob("*.py"):
        room = path.relative_to(ROOT / "solver").parts[0].removesuffix(".py")
        if room == "__init__":
            continue
        for name in imported(path):
            if name.startswith("solver."):
                assert name.split(".")[1] in {room, *SOLVER[room]}, f"{path} imports {name}"


def test_the_rooms_are_in_order():
    passed: set[str] = set()
    for room, others in SOLVER.items():
        assert others <= passed, f"{room} looks into what comes after it"
        passed.add(room)
    names = {path.name.removesuffix(".py") for path in (ROOT / "solver").iterdir()}
    assert passed == {name for name in names if not name.startswith(("__", "README", "py.typed"))}


def test_only_the_window_is_imported_by_name():
    """What of `app` imports `app.ui` does so inside a function, where the window is opened."""
    for path in sources("app"):
        tree = ast.parse(path.read_text("utf-8"))
        for node in tree.body:
            if isinstance(node, ast.ImportFrom):
                assert not (node.module or "").startswith("app.ui"), f"{path} imports {node.module}"


def loaded_by(code: str) -> set[str]:
    """The top-level modules that a fresh interpreter has loaded after `code`."""
    code += "\nimport sys\nprint(*{name.split('.')[0] for name in sys.modules})"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    return set(ran.stdout.split())


def test_the_model_loads_no_gl():
    names = ", ".join(f"app.{name}" for name in MODEL)
    assert not loaded_by(f"import {names}") & {"moderngl", *TOOLKITS}


def test_the_command_line_is_quick_to_load():
    assert not loaded_by("import app.cli") & {"moderngl", "numpy", "pydantic", "PIL", "rich", *TOOLKITS}


def test_rendering_loads_no_window():
    code = """
import numpy as np
from app.pictures import Picture
from app.recipe import Recipe
from app.replay import Replay
from app.sampling import Pictures
from solver.gl.device import Device
with Device.headless() as device:
    replay = Replay(device, Recipe.parse("[fluid]\\ngrid = 16"), Pictures(Picture(np.zeros((8, 8, 3), np.uint8))))
    replay.seek(2)
    replay.release()
"""
    modules = loaded_by(code)
    assert "moderngl" in modules
    assert not modules & TOOLKITS
