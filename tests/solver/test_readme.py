"""What modules and shaders cite of the solver's pages is there, and what those name is in the tree."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "solver" / page for page in ("README.md", "MEASURED.md", "brush/README.md")]
SOURCES = [path for room in ("solver", "shaders") for path in (ROOT / room).rglob("*.*") if path.suffix != ".md"]
EQUATION = re.compile(r"\(([SPVBH]\d)\)|equations? ([SPVBH]\d)")


def cited(text: str) -> set[str]:
    return {one or other for one, other in EQUATION.findall(text)}


def test_every_equation_that_is_cited_is_on_a_page() -> None:
    pages = "".join(page.read_text("utf-8") for page in PAGES)
    numbers = {one for line in pages.splitlines() if line.startswith("    ") for one in cited(line)}
    found = [cited(path.read_text("utf-8")) for path in SOURCES if path.suffix in (".py", ".frag", ".glsl")]
    assert any(found)
    assert cited(pages).union(*found) <= numbers


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_file_that_a_page_names_is_there(page: Path) -> None:
    names = set(re.findall(r"`([\w./]+\.(?:py|frag|glsl))`|\]\(([\w./]+)\)", page.read_text("utf-8")))
    paths = {str(path.relative_to(ROOT)) for path in [*ROOT.glob("app/**/*.py"), *ROOT.glob("tests/**/*.py"), *SOURCES]}
    for name, link in names:
        assert (page.parent / link).exists() if link else any(f"/{path}".endswith(f"/{name}") for path in paths), name
