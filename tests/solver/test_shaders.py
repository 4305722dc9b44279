"""Every shader compiles, says what it reads, and names its file and line when it is wrong."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import shaders
from solver.gl.device import Device
from solver.gl.passes import GL_SAMPLERS
from solver.gl.program import ShaderError, assemble, compile_program, read_shader
from solver.gl.tiled import TiledField
from solver.warp.frozen import FADED
from solver.warp.state import MOST_CLOSED
from support.khronos import Programs

ROOT = Path(shaders.__file__).parent
STAGES = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*.frag"))


@pytest.mark.parametrize("stage", STAGES)
def test_stage_compiles(device: Device, stage: str) -> None:
    compile_program(device.ctx, stage, {}).release()


def test_stages_that_ask_for_the_wall_compile_with_either(device: Device) -> None:
    asking = [stage for stage in STAGES if "NO_SLIP" in assemble(stage, {})[0]]
    assert asking
    for stage in asking:
        compile_program(device.ctx, stage, {"NO_SLIP": 1}).release()


@pytest.mark.parametrize(
    ("stage", "defines"),
    [
        ("warp/compose.frag", {"FROM": 1, "HELD": 1}),
        ("warp/compose.frag", {"REMAP": 1, "KEEP": 1}),
        ("warp/compose.frag", {"POINTS": 1, "HELD": 1}),
        ("warp/distortion.frag", {"POINTS": 1, "HELD": 1}),
        ("warp/strain.frag", {"POINTS": 1, "HELD": 1}),
        ("warp/seek.frag", {"POINTS": 1, "HELD": 1}),
    ],
)
def test_the_longest_map_is_read_through_no_more_textures_than_gl_promises(
    device: Device, stage: str, defines: dict[str, object]
) -> None:
    """16 a stage (OpenGL 3.3, table 6.45), with all levels, weighed, and all closed maps and what is undone of them."""
    through = {"LEVELS": 3, "WEIGHED": 7, "FADED": FADED, "CLOSED": MOST_CLOSED + 1, "UNDONE": 1 << MOST_CLOSED}
    program = compile_program(device.ctx, stage, {**through, **defines})
    names = {name for name in program if getattr(program[name], "gl_type", None) in GL_SAMPLERS}
    program.release()
    assert {f"u_closed_{number}" for number in range(MOST_CLOSED + 1)} | {"u_third", "u_held"} <= names
    assert len(names) <= 16


@pytest.mark.parametrize("stage", STAGES)
def test_stage_states_its_texel_reads(stage: str) -> None:
    assert re.search(r"^// reads: \d+", read_shader(stage), re.MULTILINE), f"{stage} lacks a line `// reads: N`"


@pytest.mark.parametrize("line", ["", "uniform float u_amount;\n"], ids=["no uniform", "a uniform"])
def test_error_names_file_and_line(device: Device, monkeypatch: pytest.MonkeyPatch, line: str) -> None:
    source = f'#include "lib/cubic.glsl"\n{line}out vec4 c;\nvoid main() {{\n    c = nonsense;\n}}\n'
    real = read_shader
    monkeypatch.setattr("solver.gl.program.read_shader", lambda path: source if path == "broken.frag" else real(path))
    with pytest.raises(ShaderError, match=rf"shaders/broken\.frag:{5 if line else 4}"):
        compile_program(device.ctx, "broken.frag", {})


def test_every_number_of_every_uniform_arrives(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    source = """uniform float u_a;
uniform vec3 u_b;
#ifdef MORE
uniform vec2 u_c;
#endif
uniform vec4 u_d;
uniform float u_e;
uniform int u_f;
layout(location = 0) out vec4 out_a;
layout(location = 1) out vec4 out_b;
layout(location = 2) out vec4 out_c;
void main() { out_a = vec4(u_a, u_b); out_b = vec4(u_c, u_e, u_f); out_c = u_d; }
"""
    real = read_shader
    monkeypatch.setattr("solver.gl.program.read_shader", lambda path: source if path == "whole.frag" else real(path))
    targets = [device.field((5, 3), 4) for _ in range(3)]
    numbers = np.random.default_rng(0).standard_normal(11).astype(np.float32)
    a, b, c, d, e = np.split(numbers, [1, 4, 6, 10])
    device.pass_("whole.frag", MORE=1)(targets, a=a[0], b=tuple(b), c=tuple(c), d=tuple(d), e=e[0], f=-7)
    found = np.concatenate([target.get() for target in targets], axis=-1)
    wanted = np.concatenate([a, b, c, e, np.array([-7], np.float32), d])
    np.testing.assert_array_equal(found, np.broadcast_to(wanted, found.shape))


def test_the_reference_compiler_finds_what_drivers_overlook(monkeypatch: pytest.MonkeyPatch) -> None:
    real = read_shader
    source = "out vec4 c;\nvoid main() { int i = 0; c = vec4(i) * texture(u_nowhere, vec2(0.5)); }\n"
    monkeypatch.setattr("solver.gl.program.read_shader", lambda path: source if path == "wrong.frag" else real(path))
    programs = Programs()
    programs.add("step/add_impulse.frag", {})
    assert not programs.complaints()
    programs.add("wrong.frag", {})
    complaint, *_ = programs.complaints()
    assert complaint.startswith("wrong.frag")
    assert "u_nowhere" in complaint


def test_missing_include_is_named() -> None:
    with pytest.raises(ShaderError, match=r"shaders/lib/nowhere\.glsl does not exist"):
        assemble("lib/nowhere.glsl", {})


def test_unknown_uniform_is_a_mistake(device: Device) -> None:
    field = device.field((4, 4), 1)
    with pytest.raises(ShaderError, match="no uniform u_sauce"):
        device.pass_("step/add_source.frag")(field, sauce=field, amount=1.0)


def test_pass_adds_within_its_region(device: Device) -> None:
    target, source = device.field((6, 5), 1), device.upload(np.ones((5, 6), np.float32))
    target.clear(1.0)
    device.pass_("step/add_source.frag")(target, add=True, region=(-2, 1, 4, 99), source=source, amount=2.0)
    expected = np.ones((5, 6), np.float32)
    expected[1:, :2] = 3.0
    np.testing.assert_array_equal(target.get(), expected)


@pytest.mark.parametrize("size", [(6, 5), (40, 9), (9, 40)])
def test_a_pass_draws_and_counts_what_of_its_regions_is_in_the_target(device: Device, size: tuple[int, int]) -> None:
    """However they reach over its sides, also where one is longer than the other; tiles know what was drawn in them."""
    (width, height), add = size, device.pass_("step/add_source.frag")
    source, long = device.upload(np.ones((height, width), np.float32)), max(size) + 3
    regions = [
        (1, 2, width - 2, height - 3), (-2, 1, 4, 2), (width - 2, 1, 4, 2), (1, -3, 2, 4), (1, height - 2, 2, 4),
        (0, 0, long, 2), (0, 0, 2, long), (-long, 1, 2 * long, 1), (1, -long, 1, 2 * long), (-3, -3, 3, 99),
        (width, 0, 5, 5), (0, height, 5, 5), (-9, -9, 99, 99),
    ]  # fmt: skip
    for chosen in (*([region] for region in regions), regions[1:5]):
        target = TiledField(device, size, 1, "target", tile=8)
        blank = target.save()
        wanted = np.zeros((height, width), np.float32)
        for x, y, across, down in chosen:
            wanted[max(y, 0) : max(y + down, 0), max(x, 0) : max(x + across, 0)] += 2.0
        device.timings.take()
        add(target, add=True, region=chosen if len(chosen) > 1 else chosen[0], source=source, amount=2.0)
        assert sum(device.timings.texel_writes.values()) == wanted.sum() / 2, chosen
        np.testing.assert_array_equal(target.get(), wanted)
        target.restore(blank)
        assert not target.get().any()
        blank.release()
        target.release()
