"""What a desktop is told about fluidwarp, and where the application begins."""

from __future__ import annotations

import configparser
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from app.media.project import SUFFIX

ROOT = Path(__file__).parent.parent
DESKTOP = ROOT / "assets" / "desktop"


def start(*words: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, DESKTOP / "start.py", *words], env=environment, capture_output=True, text=True
    )


def test_the_application_is_the_command_line_and_the_python_of_its_own_processes():
    assert start("--version").stdout.startswith("fluidwarp ")
    assert (
        start("-c", "import app.model.strokes, sys; print(app.model.strokes.__name__, sys.argv)").stdout
        == "app.model.strokes ['-c']\n"
    )
    assert '"renderer"' in start("-m", "app.doctor").stdout
    refused = start("render", "nothing.toml")
    assert refused.returncode == 1
    assert "Traceback" not in refused.stderr


@pytest.mark.parametrize("folder", ["plain", 'with space & 100 % "quoted" $HOME `x` back\\slash'])
def test_installing_writes_an_entry_that_starts_it(tmp_path: Path, folder: str):
    """And removing it leaves nothing."""
    home, program = tmp_path / "data", tmp_path / folder
    program.mkdir()
    for name in ("fluidwarp.desktop", "fluidwarp.xml", "fluidwarp.svg", "install.sh"):
        (program / name).write_bytes((DESKTOP / name).read_bytes())
    (program / "fluidwarp").write_text("#!/bin/sh\n")
    environment = os.environ | {"XDG_DATA_HOME": str(home), "PATH": "/usr/bin:/bin"}
    subprocess.run(["sh", program / "install.sh"], env=environment, check=True, capture_output=True)
    entry = configparser.RawConfigParser(interpolation=None)
    entry.optionxform = str  # type: ignore[assignment]
    entry.read(home / "applications" / "fluidwarp.desktop")
    fields = entry["Desktop Entry"]
    command = fields["Exec"].removesuffix(" edit %f")
    # First what any value is escaped by, then what a quoted argument is.
    value = command.replace("\\\\", "\\")
    argument = re.sub(r"\\(.)", r"\1", value[1:-1]).replace("%%", "%")
    assert argument == str(program / "fluidwarp")
    assert (home / "icons/hicolor/scalable/apps" / f"{fields['Icon']}.svg").exists()
    kinds = ElementTree.parse(home / "mime" / "packages" / "fluidwarp.xml").getroot()
    name = "{http://www.freedesktop.org/standards/shared-mime-info}"
    globs = {glob.attrib["pattern"]: kind.attrib["type"] for kind in kinds for glob in kind.iter(f"{name}glob")}
    assert globs[f"*{SUFFIX}"] in fields["MimeType"].split(";")
    subprocess.run(["sh", program / "install.sh", "--remove"], env=environment, check=True, capture_output=True)
    left = [path for path in home.rglob("*fluidwarp*") if path.is_file()]
    assert left == []


def test_the_licence_of_all_that_is_installed_with_it_is_listed():
    needed, waiting = set[str](), ["fluidwarp"]
    while waiting:
        for words in metadata.requires(waiting.pop()) or []:
            requirement = Requirement(words)
            name = re.sub(r"[-_.]+", "-", requirement.name).lower()
            if name not in needed and (requirement.marker is None or requirement.marker.evaluate({"extra": ""})):
                needed.add(name)
                waiting.append(name)
    table = (DESKTOP / "LICENSES.md").read_text()
    listed = re.findall(r"^\| ([a-z0-9-]+) \| \S", table, re.MULTILINE)
    assert sorted(needed) == [name for name in listed if name != "package"]
