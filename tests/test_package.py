"""What is built from the source and installed elsewhere works without it."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from PIL import Image

ROOT = Path(__file__).parent.parent


def run(*words: str | Path, cwd: Path) -> str:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    ran = subprocess.run([*map(str, words)], cwd=cwd, env=environment, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the source distribution and, made from that, the wheel."""
    folder = tmp_path_factory.mktemp("built")
    # From what a commit would hold: neither caches nor an environment.
    listed = run("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", cwd=ROOT)
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            target = folder / "source" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes((ROOT / name).read_bytes())
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, folder / "source", cwd=folder)
    return folder


def test_every_dependency_has_the_version_that_was_tested():
    """`app/constraints.txt` names one for each that the project asks for, and no older one than it admits."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    asked = [
        Requirement(line)
        for line in [*project["dependencies"], *extras["test"], *extras["cluster"], *extras["subject"]]
    ]
    lines = [line for line in (ROOT / "app" / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    tested = {canonicalize_name(name): version for name, version in (line.split("==") for line in lines)}
    missing = [wanted.name for wanted in asked if canonicalize_name(wanted.name) not in tested]
    assert missing == ["setuptools"]  # pip freeze leaves it out
    for wanted in asked:
        if wanted.name not in missing:
            assert tested[canonicalize_name(wanted.name)] in wanted.specifier, wanted


def test_the_wheel_holds_the_program_and_no_tests(built: Path):
    (wheel,) = built.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.split("/")[0] for name in names if ".dist-info/" not in name}
    assert tops == {"app", "solver", "shaders", "assets"}
    shaders = {path.relative_to(ROOT).as_posix() for path in (ROOT / "shaders").rglob("*.*") if path.suffix != ".pyc"}
    assert shaders <= set(names)
    assert any(name.endswith("/licenses/LICENSE") for name in names)


def test_the_source_distribution_is_built_from_itself(built: Path):
    (source,) = built.glob("*.tar.gz")
    with tarfile.open(source) as archive:
        names = {name.split("/", 1)[-1] for name in archive.getnames()}
    assert {"pyproject.toml", "README.md", "LICENSE", "shaders/lib/full_screen.vert", "app/cli.py"} <= names


def test_the_installed_wheel_renders_without_the_source(built: Path):
    (wheel,) = built.glob("*.whl")
    venv.create(built / "environment", with_pip=False, symlinks=True)
    folder = built / "environment" / ("Scripts" if os.name == "nt" else "bin")
    python = folder / "python"
    run(sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", wheel, cwd=built)
    # The libraries of this environment, but nothing that leads to the source.
    site = run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=built).strip()
    libraries = {str(Path(entry)) for entry in sys.path if entry.rstrip("/").endswith("site-packages")}
    Path(site, "libraries.pth").write_text("\n".join(sorted(libraries)), "utf-8")
    where = run(python, "-c", "import app, solver, shaders; print(app.__file__, solver.__file__)", cwd=built)
    assert str(ROOT) not in where
    run(folder / "fluidwarp", "render", "coffee", "-o", "coffee.png", "--size", "96", cwd=built)
    with Image.open(built / "coffee.png") as picture:
        assert picture.width == 96
        assert np.asarray(picture).std() > 20


def test_the_nightly_script_finds_the_checks_of_all_rooms(tmp_path: Path):
    shown = run(sys.executable, ROOT / "tests/nightly.py", "--seeds", "0", cwd=tmp_path)
    rooms = {path.stem for path in (ROOT / "tests/properties").glob("*.py")} - {"__init__"}
    assert {line.split(".")[0] for line in shown.splitlines()} == rooms
