"""Compiling GLSL from `shaders/`: includes, defines, and errors that name the file and the line."""

from __future__ import annotations

import re
from functools import cache
from importlib import resources
from pathlib import PurePosixPath

import moderngl

from solver.gl.context import making

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"')
_READS = re.compile(r"^//\s*reads:\s*(\d+)", re.MULTILINE)
_VERTICES = re.compile(r"^//\s*vertices:\s*(\S+)", re.MULTILINE)
# Mesa: "0:12(5): error: ..."; NVIDIA: "0(12) : error ...".
_LOG_LINE = re.compile(r"\b0(?::(\d+)\(\d+\)|\((\d+)\))")

_UNIFORM = re.compile(r"^uniform (float|vec[234]) (u_\w+);", re.MULTILINE)

FULL_SCREEN_VERTEX = "lib/full_screen.vert"


class ShaderError(RuntimeError):
    """A shader that is missing, does not compile, or is given a uniform it does not declare."""


@cache
def read_shader(path: str) -> str:
    """The text of `shaders/<path>`."""
    try:
        return resources.files("shaders").joinpath(*PurePosixPath(path).parts).read_text("utf-8")
    except (FileNotFoundError, IsADirectoryError) as error:
        raise ShaderError(f"shaders/{path} does not exist") from error


def _flatten(path: str, seen: set[str]) -> list[tuple[str, str, int]]:
    """The lines of a shader with its includes laid in once each, as (text, file, line number)."""
    lines: list[tuple[str, str, int]] = []
    for number, text in enumerate(read_shader(path).splitlines(), 1):
        if match := _INCLUDE.match(text):
            included = match.group(1)
            if included not in seen:
                seen.add(included)
                lines += _flatten(included, seen)
        else:
            lines.append((text, path, number))
    return lines


def assemble(path: str, defines: dict[str, object]) -> tuple[str, list[tuple[str, int]]]:
    """The GLSL handed to the driver, and for each of its lines the file and line it comes from."""
    head = [("#version 330 core", path, 0)]
    head += [(f"#define {name} {value}", path, 0) for name, value in sorted(defines.items())]
    lines = head + _flatten(path, {path})
    return "\n".join(text for text, _, _ in lines) + "\n", [(file, number) for _, file, number in lines]


def declared_reads(path: str) -> int:
    """Texel reads a fragment, as the header of the shader states them in a line `// reads: N`."""
    match = _READS.search(read_shader(path))
    return int(match.group(1)) if match else 0


def _vertices(fragment: str) -> str:
    """The vertex shader of a fragment shader: that which its header names in a line `// vertices: FILE`."""
    match = _VERTICES.search(read_shader(fragment))
    return match.group(1) if match else FULL_SCREEN_VERTEX


def _carried(vertex: str, fragment: str) -> tuple[str, str]:
    """Both shaders, the uniforms of the fragment shader handed over in flat varyings, up to four numbers in each.

    For every number of a uniform that a fragment shader reads, llvmpipe (Mesa 22.3) spends some twenty instructions on
    each group of fragments, as if each of them read another one; a flat varying costs one, and holds the very same
    number. The line after `#version` is new in both.
    """
    places: dict[str, tuple[str, str]] = {}
    filled: list[int] = []
    for kind, name in dict.fromkeys(_UNIFORM.findall(fragment)):
        count = 1 if kind == "float" else int(kind[-1])
        slot = next((slot for slot, numbers in enumerate(filled) if numbers + count <= 4), len(filled))
        filled += [0] * (slot + 1 - len(filled))
        places[name] = kind, f"v_uniforms_{slot}.{'xyzw'[filled[slot] : filled[slot] + count]}"
        filled[slot] += count
    if not places:
        return vertex, fragment
    varyings = f"flat {{}} vec4 {', '.join(f'v_uniforms_{slot}' for slot in range(len(filled)))};"
    declared = [f"uniform {kind} {name};" for name, (kind, _) in places.items()]
    uniforms = " ".join(line for line in declared if line not in vertex)
    handed_over = " ".join(f"{place} = {name};" for name, (_, place) in places.items())
    vertex = vertex.replace("void main() {", f"void main() {{ {handed_over}", 1)
    fragment = _UNIFORM.sub(lambda found: f"#define {found[2]} {places[found[2]][1]}", fragment)
    return (
        vertex.replace("\n", f"\n{uniforms} {varyings.format('out')}\n", 1),
        fragment.replace("\n", f"\n{varyings.format('in')}\n", 1),
    )


def program_sources(fragment: str, defines: dict[str, object]) -> tuple[str, str, list[tuple[str, int]]]:
    """The GLSL of the vertex and of the fragment shader of a program, and where each line of the latter comes from."""
    vertex_source, _ = assemble(_vertices(fragment), {})
    source, table = assemble(fragment, defines)
    vertex_source, source = _carried(vertex_source, source)
    table = table[: source.count("\n") - len(table)] + table
    return vertex_source, source, table


def compile_program(ctx: moderngl.Context, fragment: str, defines: dict[str, object]) -> moderngl.Program:
    """The program of a fragment shader: over the whole screen, or with the vertex shader that its header names.

    Raises:
        ShaderError: if it does not compile; names the file and the line, includes resolved.
        ContextError: as `making`.
    """
    vertex_source, source, table = program_sources(fragment, defines)

    def place(match: re.Match[str]) -> str:
        line = int(match.group(1) or match.group(2))
        file, number = table[min(line, len(table)) - 1]
        return f"shaders/{file}:{number}"

    try:
        with making():
            return ctx.program(vertex_shader=vertex_source, fragment_shader=source)
    except moderngl.Error as error:
        raise ShaderError(f"shaders/{fragment} does not compile:\n{_LOG_LINE.sub(place, str(error))}") from error
