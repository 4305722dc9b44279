"""What the Khronos reference compiler says of our shaders: drivers accept much that is no GLSL."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from solver.gl.program import program_sources


class Programs:
    """The programs that have been compiled, once for each set of defines."""

    def __init__(self) -> None:
        self._sources: dict[str, tuple[str, str]] = {}

    def add(self, fragment: str, defines: dict[str, object]) -> None:
        """Note the program of a fragment shader."""
        vertex_source, fragment_source, _ = program_sources(fragment, defines)
        self._sources[f"{fragment} {dict(sorted(defines.items()))}"] = vertex_source, fragment_source

    def complaints(self) -> list[str]:
        """What glslangValidator finds wrong with them, each beginning with the shader and its defines."""
        found: list[str] = []
        if not self._sources:
            return found
        with tempfile.TemporaryDirectory() as folder:
            names: dict[str, str] = {}
            for number, (name, sources) in enumerate(self._sources.items()):
                for kind, text in zip(("vert", "frag"), sources, strict=True):
                    path = Path(folder, f"{number}.{kind}")
                    path.write_text(text, "utf-8")
                    names[str(path)] = name
            ran = subprocess.run(["glslangValidator", *names], capture_output=True, text=True)
        at = ""
        for line in ran.stdout.splitlines():
            at = names.get(line, at)
            if line.startswith("ERROR: 0:"):
                found.append(f"{at}: {line}")
        assert found or ran.returncode == 0, ran.stdout + ran.stderr
        return found
