"""A recipe gives the same for ever: numbers of short runs of all that one can have, as `golden` has them.

`runs.txt` has what comes of them, and `passes.txt` what each pass draws at first.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from app.media.auxiliary import Pictures
from app.media.pictures import write_picture
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.model.schema import frozen
from app.work.export import displacement
from app.work.replay import Replay
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.grid import Grid
from solver.params import FluidParams, Walls
from solver.resample.plan import Edges, GivenMap, Sampling
from solver.resample.sampler import Sampler
from support.drawn_passes import FirstDraws
from support.gl_objects import Made
from support.golden import CLOSE, GOLDEN, Golden, told

RUNS: dict[str, Any] = tomllib.loads((GOLDEN / "runs.toml").read_text("utf-8"))
TICKS = 9


def picture(width: int = 60, height: int = 45, channels: int = 3) -> np.ndarray:
    """Smooth and rough, with no symmetry, (h, w, c) uint8."""
    y, x = np.mgrid[0:height, 0:width] / width
    waves = [np.sin((7 + 3 * k) * x + 2 * k) * np.cos((5 + 4 * k) * y + k) for k in range(channels)]
    rough = np.random.default_rng(1).random((height, width, channels))
    return ((0.4 * np.stack(waves, axis=-1) + 0.5 + 0.1 * rough).clip(0, 1) * 255).astype(np.uint8)


def as_drawn(name: str, wanted: list[float]) -> float:
    """How near to what is written down the numbers of a pass must be, whatever the processor's last bits are.

    A residual is left of velocities about 1, each rounded by 6e-8. Evenness goes by slopes of slopes: one unit in the
    last place of a force's sine or root moves it by .7 %.
    """
    if "/evenness.frag" in name:
        return 0.02 * abs(wanted[0])
    return CLOSE * abs(wanted[0]) + (2e-8 if "residual.frag" in name else 1e-9)


def cost(device: Device) -> list[float]:
    """How many passes, and thousands of texels read and written, in all stages, since they were last taken."""
    timings = device.timings
    passes, *texels = (sum(book.values()) for book in (timings.passes, timings.texel_reads, timings.texel_writes))
    return [float(passes), *(count / 1e3 for count in texels)]


@pytest.fixture(scope="module")
def passes(shared_device: Device) -> Iterator[Golden]:
    with Golden.of_software(shared_device, "passes.txt") as golden:
        yield golden


@pytest.fixture(scope="module")
def golden(shared_device: Device) -> Iterator[Golden]:
    with Golden.of_software(shared_device, "runs.txt") as golden:
        yield golden


@pytest.mark.parametrize("name", RUNS)
def test_a_run_gives_the_numbers_that_are_written_down(
    device: Device, name: str, golden: Golden, passes: Golden, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, drawn = Made(monkeypatch), FirstDraws(monkeypatch)
    write_picture(tmp_path / "field.png", Picture(picture(30, 20)))
    parts = {"duration": 1.0} | RUNS[name]
    size = parts.pop("size", (60, 45))
    parts["fluid"] = {"grid": 36, "dt": 0.025, "viscosity": 0.002} | parts.get("fluid", {})
    replay = Replay(device, Recipe.model_validate(frozen(parts)), Pictures(Picture(picture(*size)), tmp_path))
    found: dict[str, list[float]] = {}
    try:
        device.timings.take()
        for _ in range(TICKS):
            replay.advance()
        # What is left out or ends early changes no other number.
        found["passes, thousands of texels read and written"] = cost(device)
        replay.fluid.measuring = True
        found["map"] = told(replay.warp.read())
        found["velocity"] = told(replay.fluid.velocity_at_centres())
        found["viscosity"] = told(np.log(replay.fluid.viscosity.get() + 1e-9))
        found["solid"] = told(replay.fluid.solid.get())
        found["pressure"] = told(replay.fluid.pressure())
        motion, statistics = replay.fluid.motion(), replay.warp.statistics()
        found |= {f"motion {key}": [float(value)] for key, value in vars(motion).items()}
        found |= {f"map {key}": [float(value)] for key, value in vars(statistics).items()}
        for forward in (False, True):
            found[f"displacement {forward}"] = told(displacement(replay, (30, 24), 3, forward).values)
        if replay.density is not None:
            found["density"] = told(replay.density.get())
        if replay.handles.handles:
            found["handles"] = told(np.concatenate([replay.handles.places.ravel(), replay.handles.away]))
        replay.advance()
        residuals = replay.fluid.residuals
        # What a fixed number of cycles leaves tells how good they are.
        found["decades of divergence left"] = [np.log10(max(residuals.divergence_left, 1e-7))]
        if residuals.viscous_residual is not None:
            found["decades of viscous residual"] = [np.log10(max(residuals.viscous_residual, 1e-7))]
    finally:
        replay.release()
    assert not made.left, "these are still on the GPU"
    passes.compare_all({f"{name} {what}": row for what, row in drawn.rows.items()}, f"{name} ", as_drawn)
    for what, numbers in found.items():
        golden.compare(f"{name} {what}", numbers, 0.1 if what.startswith("decades") else None)


@pytest.mark.parametrize("contrast", [False, True])
def test_a_fluid_of_one_s_own_takes_the_steps_that_are_written_down(
    device: Device, contrast: bool, passes: Golden, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Walls that move, solids one cell thin, and a velocity that is given."""
    drawn, grid = FirstDraws(monkeypatch), Grid(44, 29)
    x, y = grid.centres()
    fluid = Fluid(device, grid, FluidParams(walls=Walls("none", (0.3, -0.2, 1.0, 0.5)), drag=0.4))
    try:
        fluid.set_viscosity(np.where((x < 0.5) & contrast, 1e-3, 0.1))
        if contrast:
            fluid.set_solid((np.random.default_rng(4).random(x.shape) < 0.06) | (np.abs(x - 0.4) + y < 0.02))
        fluid.set_velocity(lambda x, y, t: (np.sin(5 * y + x), np.cos(4 * x - y)))
        for _ in range(3):
            fluid.step(0.05, lambda x, y, t: (0 * x, x - y))
    finally:
        fluid.release()
    name = f"contrast {contrast}"
    passes.compare_all({f"{name} {what}": row for what, row in drawn.rows.items()}, f"{name} ", as_drawn)


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_pictures_are_looked_up_as_it_is_written_down(
    device: Device, channels: int, golden: Golden, passes: Golden, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = FirstDraws(monkeypatch)
    y, x = np.mgrid[0:30, 0:40] / 40
    values = np.stack([0.2 * np.sin(9 * y) + 0.1 * x, 0.15 * np.cos(11 * x) - 0.2 * y], axis=-1).astype(np.float32)
    warp, sampler = GivenMap(device, values), Sampler(device)
    device.timings.take()
    pixels = picture(channels=channels)
    depths = pixels, pixels.astype(np.uint16) * 257, (pixels / 200).astype(np.float32)
    ways: list[tuple[int, dict[str, Any], tuple[int, int] | None]] = [
        *((depth, {}, None) for depth in range(3)), (0, {}, (33, 51)), (1, {"samples": 1}, (91, 40)),
    ]  # fmt: skip
    if channels == 4:
        edges = get_args(Edges)
        ways += [(number % 3, {"edges": edge}, (70, 50)) for number, edge in enumerate(edges)]
        ways += [
            (0, {"quality": "bilinear"}, None),
            (2, {"quality": "nearest"}, None),
            (0, {"premultiplied": True}, None),
        ]
        ways += [(1, {"linear_light": False, "samples": 4}, None), (0, {"dither": False}, None)]
    try:
        for depth, way, size in ways:
            found = sampler.apply(warp, depths[depth], size, Sampling(**way))
            golden.compare(f"{channels} channels, {depths[depth].dtype} {way} {size}".replace(": ", " "), told(found))
    finally:
        sampler.release()
        warp.release()
    rows = {f"{channels} channels {what}": row for what, row in drawn.rows.items()}
    passes.compare_all(rows, f"{channels} channels ", as_drawn)
    golden.compare(f"{channels} channels, passes, thousands of texels read and written", cost(device))
