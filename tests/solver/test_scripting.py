"""The solver as a script uses it: the README's own code, what is refused at the call, and what is read out."""

from __future__ import annotations

import multiprocessing
import re
import subprocess
import sys
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from solver import (
    Brush,
    Density,
    Device,
    Fluid,
    FluidParams,
    Grid,
    Handle,
    Handles,
    Masks,
    PaperFluid,
    PaperWarpMap,
    Tip,
    Walls,
    WarpMap,
)
from solver.brush.push import Push
from solver.brush.tip import Path as TipPath
from solver.gl.context import ContextError
from solver.gl.field import Field, FieldError
from solver.resample.plan import Sampling
from solver.resample.sampler import Sampler
from solver.warp.inverse import ForwardMap
from solver.warp.scaled import ScaledMap
from support import reference

SECTION = (Path(__file__).parents[2] / "README.md").read_text("utf-8").split("## Scripting")[1].split("\n## ")[0]
BLOCKS = re.findall(r"```python\n(.*?)```", SECTION, re.DOTALL)


CHECKED = """
assert vorticity.shape == stream.shape == (41, 65)
assert abs(displacement).max() > 0.01
assert fluid.motion().kinetic_energy > 0
assert handles.away.max() <= 0.001
assert warp.statistics().folds == 0
"""


def test_the_readmes_code_runs() -> None:
    """In a process of its own, as it makes its own device."""
    script = BLOCKS[0].replace("Grid(320, 200)", "Grid(64, 40)") + CHECKED
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert "Fluid(64 x 40 cells, t = 1 s, no-slip walls" in result.stdout
    # The plot needs what is no dependency; it uses what the first block made.
    assert {"vorticity", "stream"} <= set(compile(BLOCKS[1], "README.md", "exec").co_names)


@pytest.fixture
def fluid(device: Device) -> Any:
    fluid = Fluid(device, Grid(20, 12))
    fluid.set_velocity(reference.smooth_velocity(20, 12, seed=1))
    fluid.project()
    yield fluid
    fluid.release()


def float16(number: float) -> Any:
    """In which the largest number that is accepted is infinite."""
    return np.float16(number)


WRONG: dict[str, tuple[Callable[[Any], object], str]] = {
    "a step of NaN": (lambda fluid: fluid.step(float("nan")), "step"),
    "a step of a day": (lambda fluid: fluid.step(86400.0), "step"),
    "a negative step": (lambda fluid: fluid.step(-0.1), "step"),
    "an endless step": (lambda fluid: fluid.step(np.inf), "step"),
    "a negative diffusion": (lambda fluid: fluid.diffuse(-0.1), "step"),
    "a transposed force": (lambda fluid: fluid.step(0.1, np.zeros((20, 12, 2))), "shape"),
    "a force of one component": (lambda fluid: fluid.step(0.1, np.zeros((12, 20))), "shape"),
    "a force of NaN": (lambda fluid: fluid.step(0.1, lambda x, y, t: (x * np.nan, y)), "finite"),
    "a force that is too large": (lambda fluid: fluid.step(0.1, np.full((12, 20, 2), 1e30)), "beyond"),
    "a field that is too large": (
        lambda fluid: fluid.step(0.1, [(fluid.device.upload(np.full((12, 20, 2), 1e30)), 1.0)]),
        "too large",
    ),
    "an impulse of NaN": (
        lambda fluid: fluid.step(0.1, [(fluid.device.upload(np.ones((12, 20, 2))), np.nan)]),
        "impulse",
    ),
    "a source that is too large": (
        lambda fluid: (fluid.add_source(fluid.device.upload(np.full((12, 20), 1e30))), fluid.step(0.1)),
        "beyond",
    ),
    "a force of one array": (lambda fluid: fluid.step(0.1, lambda x, y, t: x), "two components"),
    "a complex force": (lambda fluid: fluid.step(0.1, np.full((12, 20, 2), 1j)), "real"),
    "a velocity of nothing": (lambda fluid: fluid.set_velocity(np.full((12, 20, 2), None)), "real"),
    "solids of words": (lambda fluid: fluid.set_solid(np.full((12, 20), "ice")), "real"),
    "a source of another grid": (lambda fluid: fluid.add_source(fluid.device.upload(np.ones((5, 20)))), "source"),
    "a source of two components": (lambda fluid: fluid.add_source(fluid.device.upload(np.ones((12, 20, 2)))), "source"),
    "sticky walls": (lambda fluid: Walls(cast(Any, "sticky")), "slip"),
    "walls of no speed": (lambda fluid: Walls("none", (np.nan, 0.0, 0.0, 0.0)), "speeds"),
    "walls that are too fast": (lambda fluid: Walls("none", (0.0, 0.0, np.inf, 0.0)), "speeds"),
    "two walls": (lambda fluid: Walls("none", cast(Any, (1.0, 0.0))), "speeds"),
    "a drag that drives": (lambda fluid: FluidParams(drag=-100.0), "drag"),
    "a drag beyond any float": (lambda fluid: FluidParams(drag=10**400), "drag"),
    "a drag of NaN": (lambda fluid: FluidParams(drag=np.nan), "drag"),
    "no cycle": (lambda fluid: FluidParams(pressure_cycles=0), "cycles"),
    "half a sweep": (lambda fluid: FluidParams(sweeps=cast(Any, 1.5)), "sweeps"),
    "half a cell": (lambda fluid: Grid(cast(Any, 20.5), 12), "whole"),
    "a picture of NaN": (lambda fluid: Grid(20, 12, (1.0, np.nan)), "picture"),
    "no picture": (lambda fluid: Grid.for_picture(0, 5, 64), "picture"),
    "an endless diffusion of a density": (lambda fluid: Density(fluid.device, np.ones((12, 20)), np.inf), "diffusion"),
    "a source of another density": (
        lambda fluid: Density(fluid.device, np.ones((12, 20)), 0.0, np.ones((5, 5))),
        "shape",
    ),
    "a transposed velocity": (lambda fluid: fluid.set_velocity(np.zeros((20, 12, 2))), "shape"),
    "a row as viscosity": (lambda fluid: fluid.set_viscosity(np.ones((1, 20))), "shape"),
    "a negative viscosity": (lambda fluid: fluid.set_viscosity(-1.0), "viscosity"),
    "transposed solids": (lambda fluid: fluid.set_solid(np.zeros((20, 12), bool)), "shape"),
    "a push of NaN": (
        lambda fluid: Brush(fluid.device).push(fluid, Tip((0.1, np.nan), (0.2, 0.1), 0.1), 0.1),
        "brush",
    ),
    "a push in no time": (lambda fluid: Brush(fluid.device).push(fluid, Tip((0.1, 0.1), (0.2, 0.1), 0.1), 0.0), "time"),
    "a force that is a field alone": (
        lambda fluid: fluid.step(0.1, [fluid.device.upload(np.ones((12, 20, 2)))]),
        "law",
    ),
    "a force of another shape": (lambda fluid: fluid.step(0.1, lambda x, y, t: (x[:5], y)), "shape"),
    "a force that gives nothing": (lambda fluid: fluid.step(0.1, lambda x, y, t: cast(Any, None)), "two components"),
    "a flow on another picture": (lambda fluid: fluid.flow_on(Grid(20, 20)), "picture"),
    "a flow on another grid": (lambda fluid: fluid.go_on_with(fluid.flow_on(Grid(30, 18))), "take over"),
    "a side that is not told of": (lambda fluid: Walls(sticky=cast(Any, (True,))), "sticky"),
    "an endless number of cycles": (lambda fluid: FluidParams(pressure_cycles=cast(Any, np.inf)), "cycles"),
    "cells of NaN": (lambda fluid: Grid(cast(Any, np.nan), 12), "whole"),
    "a density of five": (lambda fluid: Density(fluid.device, np.ones((12, 20, 5))), "shape"),
    "a density set to another shape": (
        lambda fluid: Density(fluid.device, np.ones((12, 20))).set(np.ones((12, 20, 3))),
        "shape",
    ),
    "a density that is too large": (lambda fluid: Density(fluid.device, np.full((12, 20), 1e39)), "beyond"),
    "a density of NaN": (
        lambda fluid: Density(fluid.device, np.ones((12, 20))).set(np.full((12, 20), np.nan)),
        "beyond",
    ),
    "a velocity that is too large": (lambda fluid: fluid.set_velocity(np.full((12, 20, 2), -1e30)), "beyond"),
    "a map that is too large": (
        lambda fluid: WarpMap(fluid.device, fluid.grid).set(np.full((12, 20, 2), 1e39)),
        "beyond",
    ),
    "a place that is too far": (
        lambda fluid: WarpMap(fluid.device, fluid.grid).at(np.array([[1e39, 0.0]])),
        "beyond",
    ),
    "NaN times a source": (lambda fluid: fluid.add_source(fluid.viscosity, np.nan), "amount"),
    "NaN times a motion": (lambda fluid: fluid.add_local(fluid.device.upload(np.ones((12, 20, 2))), np.nan), "amount"),
    "NaN times a brush": (
        lambda fluid: Brush(fluid.device).lead(fluid, Push(Tip((0.1, 0.1), (0.2, 0.1), 0.1), 0.1), np.nan),
        "gain",
    ),
    "thickened by NaN": (
        lambda fluid: Masks(fluid.device, fluid.grid).thicken(Tip((0, 0), (0, 0), 0.1), np.nan),
        "thick",
    ),
    "frozen by NaN": (lambda fluid: Masks(fluid.device, fluid.grid).freeze(Tip((0, 0), (0, 0), 0.1), np.nan), "freez"),
    "smoothed by NaN": (
        lambda fluid: Masks(fluid.device, fluid.grid).smooth(Tip((0, 0), (0, 0), 0.1), np.nan),
        "smooth",
    ),
    "a density moved by one component": (
        lambda fluid: Density(fluid.device, np.ones((12, 20))).advance(fluid.viscosity, fluid.grid, 0.1),
        "velocity",
    ),
    "a negative viscosity to paint on": (lambda fluid: Masks(fluid.device, fluid.grid).set_base(-1.0), "viscosity"),
    "frozen texels of NaN": (
        lambda fluid: Masks(fluid.device, fluid.grid).set_frozen(np.full((12, 20), np.nan)),
        "frozen",
    ),
    "masks of another picture": (lambda fluid: Masks(fluid.device, Grid(20, 20)).apply(fluid), "picture"),
    "a brush in three dimensions": (lambda fluid: Tip(cast(Any, (0, 0, 0)), (0.1, 0.1), 0.1), "place"),
    "a handle in three dimensions": (lambda fluid: Handle(cast(Any, (0.3, 0.3, 0.3))), "shape"),
    "a key without a place": (lambda fluid: Handle((0.3, 0.3), keys=cast(Any, ((1.0, 0.4),))), "shape"),
    "handles led in no time": (
        lambda fluid: Handles(fluid, WarpMap(fluid.device, fluid.grid), [Handle((0.3, 0.3), (0.4, 0.3))]).advance(0.0),
        "time",
    ),
    "handles led in next to no time": (
        lambda fluid: Handles(fluid, WarpMap(fluid.device, fluid.grid), [Handle((0.3, 0.3))]).advance(5e-324),
        "time",
    ),
    "a line of a number": (lambda fluid: Handle((0.3, 0.3), points=cast(Any, np.array(0.1))), "shape"),
    "a picture at an unknown quality": (lambda fluid: Sampling(quality=cast(Any, "best")), "quality"),
    "three samples": (lambda fluid: Sampling(samples=3), "samples"),
    "a picture at no size": (
        lambda fluid: Sampler(fluid.device).apply(
            WarpMap(fluid.device, fluid.grid), np.zeros((6, 6), np.uint8), (0, 5)
        ),
        "size|result",
    ),
    "a field of a part of a texel": (lambda fluid: fluid.device.field(cast(Any, (2.5, 3))), "whole"),
    "words on the GPU": (lambda fluid: fluid.device.upload(np.full((3, 3), "a")), "real"),
    "a local motion that is too fast": (
        lambda fluid: (
            fluid.add_local(fluid.device.upload(1e30 * reference.smooth_velocity(20, 12, seed=3)), 1e6),
            WarpMap(fluid.device, fluid.grid).follow(fluid, 0.1),
        ),
        "too fast",
    ),
    "an endless drag in 16 bits": (lambda fluid: FluidParams(drag=float16(np.inf)), "drag"),
    "an endless diffusion in 16 bits": (
        lambda fluid: Density(fluid.device, np.ones((12, 20)), float16(np.inf)),
        "diffusion",
    ),
    "a grid beyond any float": (lambda fluid: Grid.for_picture(10**400, 16, 64), "larger than any float"),
    "a brush beyond any float": (lambda fluid: Tip((0, 0), (0, 0), 0.1, 10**400), "larger than any float"),
    "a negative strain": (lambda fluid: fluid.strain(-0.1), "step"),
    "a velocity with holes": (lambda fluid: fluid.set_velocity(np.ma.masked_less(np.zeros((12, 20, 2)), 1)), "masked"),
    "viscosity with holes": (lambda fluid: fluid.set_viscosity(np.ma.masked_less(np.zeros((12, 20)), 1)), "masked"),
    "frozen places with holes": (lambda fluid: fluid.device.upload(np.ma.masked_less(np.zeros((3, 4)), 1)), "masked"),
    "ragged rows": (lambda fluid: fluid.device.upload(cast(Any, [[1, 2], [3]])), "unequal length"),
    "a force of a number as an array": (
        lambda fluid: fluid.step(0.1, lambda x, y, t: cast(Any, np.array(3.0))),
        "gave 1",
    ),
    "a density of nothing": (lambda fluid: Density(fluid.device, np.ones((0, 20))), "shape"),
    "a fluid laid on another picture": (lambda fluid: fluid.lay_on(Grid(20, 12, (1.0, 0.7))), "cannot be laid"),
    "a velocity of the paper's map that is too large": (
        lambda fluid: PaperWarpMap(fluid.device, fluid.grid).advance_prescribed(np.full((12, 20, 2), 3e38), 1e4),
        "beyond",
    ),
    "a brush far off, by NumPy's numbers": (
        lambda fluid: Tip((np.float64(1e300), np.float64(2)), (0, 0), 0.1),
        r"from \(1e\+300, 2\) to \(0, 0\)",
    ),
    "an endless growth": (lambda fluid: Brush(fluid.device).expand(fluid, Tip((0, 0), (0, 0), 0.1), np.inf), "rate"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_simulated_is_refused_and_nothing_has_happened(fluid: Fluid, name: str) -> None:
    act, told = WRONG[name]
    before = fluid.u
    with pytest.raises(ValueError, match=told):
        act(fluid)
    np.testing.assert_array_equal(fluid.u, before)
    fluid.step(0.01)
    assert np.isfinite(fluid.u).all()


def fail(_: Field) -> None:
    raise KeyError("it fails")


FAILING: dict[str, Callable[[Fluid, Field], object]] = {
    "what steers fails": lambda fluid, _: fluid.step(0.1, np.ones((12, 20, 2)), fail),
    "what steers makes too much": lambda fluid, huge: fluid.step(0.1, (), lambda faces: faces.copy_from(huge)),
    "a stage makes too much": lambda fluid, huge: fluid.add_force([(huge, 1.0)], 0.1),
    "brushes do": lambda fluid, huge: (fluid.impulse.add(lambda faces: faces.copy_from(huge)), fluid.step(0.1)),
    "they do in a stage": lambda fluid, huge: (fluid.impulse.add(lambda f: f.copy_from(huge)), fluid.add_force((), 1)),
}


@pytest.mark.parametrize("name", FAILING)
def test_what_fails_on_the_way_leaves_the_velocity_as_if_it_had_just_been_set(fluid: Fluid, name: str) -> None:
    fluid.step(0.1)
    before, huge = fluid.faces().get(), fluid.device.upload(np.full((12, 20, 2), 1e30))
    with pytest.raises((ValueError, KeyError), match=r"beyond|too large|fails"):
        FAILING[name](fluid, huge)
    np.testing.assert_array_equal(fluid.faces().get(), before)
    other = Fluid(fluid.device, fluid.grid)
    other.set_velocity(before)
    for one in (fluid, other):
        one.step(0.1)
    np.testing.assert_array_equal(fluid.u, other.u)
    other.release()


def test_a_velocity_as_large_as_may_be_set_goes_on(device: Device) -> None:
    """Up and down from face to face, which the projection leaves nearly as it is, with a stage and with a step."""
    fluid = Fluid(device, Grid(20, 12))
    sign = (-1.0) ** np.indices((12, 20)).sum(axis=0)
    for act in (lambda: fluid.step(1e-9), lambda: fluid.advect(1e-9), lambda: fluid.add_force((), 0.1)):
        fluid.set_velocity(1e6 * np.stack([sign, sign], axis=-1))
        act()
        assert np.isfinite(fluid.u).all()
    fluid.release()


@pytest.mark.parametrize(
    "act",
    [
        lambda warp: warp.set(np.zeros((40, 24, 2))),
        lambda warp: warp.set(np.zeros((24, 40))),
        lambda warp: warp.advance_prescribed(np.zeros((20, 12, 2)), 0.1),
        lambda warp: warp.advance_prescribed(np.zeros((12, 20)), 0.1),
        lambda warp: warp.advance_prescribed(np.zeros((12, 20, 2)), -0.1),
        lambda warp: warp.advance_prescribed(lambda x, y, t: (x, y), np.nan),
        lambda warp: warp.advance_prescribed(lambda x, y, t: x, 0.1),
        lambda warp: warp.advance(warp.device.upload(np.zeros((12, 20))), 0.1),
        lambda warp: warp.follow(Fluid(warp.device, Grid(20, 12, (0.5, 0.3), (0.1, 0.1), (1.0, 0.6))), 0.1),
        lambda warp: warp.set(np.full((12, 20, 2), 1e38)),
        lambda warp: warp.restore_under((0.3, 0.3), 0.1, amount=np.nan),
        lambda warp: warp.restore_under((0.3, 0.3), 0.1, hardness=np.nan),
        lambda warp: warp.restore_under((0.3, 0.3), np.inf),
        lambda warp: warp.restore_under((0.3, 0.3), 0.1, amount=-1.0),
        lambda warp: warp.restore_under((0.3, 0.3), 0.1, amount=1.5),
        lambda warp: warp.restore_under((0.3, 0.3), 0.1, hardness=-0.1),
        lambda warp: warp.restore_under((0.3, 0.3), 0.0),
        lambda warp: ScaledMap(warp, -1.0),
        lambda warp: ScaledMap(warp, np.nan),
        lambda warp: warp.determinants(np.zeros((3, 3))),
        lambda warp: ForwardMap(warp).at(np.zeros((3, 3))),
        lambda warp: warp.read((40.5, 24)),
        lambda warp: warp.statistics("all"),
        lambda warp: warp.statistics([[1], [1, 2]]),
        lambda warp: warp.advance_prescribed(np.full((12, 20, 2), 1e30), 0.1),
        lambda warp: warp.advance_prescribed(lambda x, y, t: (x + 1e308, y), 0.1),
    ],
    ids=[
        "transposed",
        "one component",
        "transposed velocity",
        "velocity",
        "negative step",
        "NaN step",
        "function",
        "field",
        "fluid of a window",
        "too large",
        "amount of NaN",
        "hardness of NaN",
        "endless radius",
        "negative amount",
        "more than all",
        "negative hardness",
        "no radius",
        "negative part",
        "part of NaN",
        "places of determinants",
        "places of the forward map",
        "half a pixel",
        "size of a word",
        "size of unequal rows",
        "velocity too large",
        "function too large",
    ],
)
def test_a_map_refuses_what_does_not_fit(device: Device, act: Callable[[WarpMap], object]) -> None:
    warp = WarpMap(device, Grid(20, 12))
    with pytest.raises(ValueError, match=r"shape|transposed|step|wanted|components|cannot follow|beyond|must be"):
        act(warp)
    assert not warp.read().any()
    warp.release()


def test_each_stage_alone_does_what_it_says(fluid: Fluid) -> None:
    energies = [fluid.motion().kinetic_energy]
    fluid.set_viscosity(1e-3)
    for stage in (lambda: fluid.diffuse(0.1), lambda: fluid.advect(0.1), fluid.project):
        stage()
        energies.append(fluid.motion().kinetic_energy)
    assert energies[-1] > 0.1 * energies[0]  # `diffuse` alone once left nothing
    assert energies[1] < energies[0]
    assert np.abs(fluid.divergence()).max() < 1e-3 * np.abs(fluid.vorticity()).max()
    before = fluid.u
    fluid.add_force(np.ones((12, 20, 2)), 0.1)
    np.testing.assert_allclose(fluid.u[:, 1:-1] - before[:, 1:-1], 0.1, atol=1e-6)
    energy = fluid.motion().kinetic_energy
    fluid.set_viscosity(1.0)  # which it takes up by itself
    fluid.diffuse(0.1)
    assert fluid.motion().kinetic_energy < 0.5 * energy


@pytest.mark.parametrize("kind", [Fluid, PaperFluid])
def test_a_saved_moment_is_a_copy_and_comes_back(device: Device, kind: type[Fluid | PaperFluid]) -> None:
    fluid = kind(device, Grid(24, 16))
    fluid.set_viscosity(1e-3)
    fluid.step(0.1, lambda x, y, t: (np.sin(5 * y), np.cos(4 * x)))
    state = fluid.save()
    for _ in range(4):
        fluid.step(0.1)
    wanted, time = fluid.u, fluid.time
    for _ in range(2):  # a state that is live would be other a second time
        fluid.restore(state)
        assert fluid.time == pytest.approx(0.1)
        for _ in range(4):
            fluid.step(0.1)
        np.testing.assert_array_equal(fluid.u, wanted)
    assert fluid.time == time
    other = kind(device, Grid(16, 24))
    for time in ({}, {"time": np.array(np.nan)}, {"time": np.zeros(2)}):
        timeless = state.with_arrays(device, {k: v for k, v in state.arrays().items() if k != "time"} | time)
        with pytest.raises(ValueError, match="of no time"):
            fluid.restore(timeless)
        timeless.release()
    for name in state.fields:
        whole = state.arrays()
        for part in ({}, {name: whole[name][:-1]}, {name: whole[name].astype(np.float16)}):
            rest = {key: values for key, values in whole.items() if key != name} | part
            with pytest.raises(ValueError, match=f"its {name} is missing or of another size"):
                state.with_arrays(device, rest)
    elsewhere = kind(device, Grid(24, 16, (0.5, 1 / 3), (0.1, 0.1), (1.0, 2 / 3)))  # as many cells, of half the size
    for wrong in (other, elsewhere):
        with pytest.raises(ValueError, match="another grid"):
            wrong.restore(state)
        assert not wrong.u.any()
        wrong.release()
    state.release()
    fluid.release()


@pytest.mark.parametrize("walls", [Walls(), Walls("none", (0.0, 0.0, 1.0, 0.0))], ids=["free", "none"])
def test_vorticity_and_stream_function_are_those_of_a_known_flow(device: Device, walls: Walls) -> None:
    """psi = sin pi x sin pi y: u = psi_y, v = -psi_x, vorticity 2 pi^2 psi but at walls that hold on to the fluid."""
    grid = Grid(64, 64)
    fluid = Fluid(device, grid, FluidParams(walls))
    sin, cos, pi = np.sin, np.cos, np.pi
    fluid.set_velocity(lambda x, y, t: (pi * sin(pi * x) * cos(pi * y), -pi * cos(pi * x) * sin(pi * y)))
    x, y = np.meshgrid(np.linspace(0, 1, 65), np.linspace(0, 1, 65))
    psi = sin(pi * x) * sin(pi * y)
    inner = np.s_[1:-1, 1:-1]
    np.testing.assert_allclose(fluid.stream_function(), psi, atol=1e-3)
    np.testing.assert_allclose(fluid.vorticity()[inner], 2 * pi**2 * psi[inner], atol=2e-2)
    assert fluid.u.shape == (64, 65)
    assert fluid.v.shape == (65, 64)
    assert fluid.motion().kinetic_energy == pytest.approx(pi**2 / 4, rel=1e-3)
    assert fluid.motion().largest_speed == pytest.approx(pi, rel=1e-3)
    top = fluid.vorticity()[0, 32]  # -du/dy between the wall's speed and the first row's
    first = fluid.u[0, 32]
    assert top == pytest.approx(0.0 if walls.slip == "free" else (1.0 - first) * 2 * 64, abs=1e-2)
    assert "64 x 64" in repr(fluid)
    fluid.release()


def test_forces_as_fields_arrays_and_functions_do_the_same(device: Device) -> None:
    grid, found = Grid(24, 16), []

    def push(x: np.ndarray, y: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        return np.sin(3 * y) * (1 + 10 * t), np.cos(2 * x)  # a uniform push, walls would hold up

    (ux, uy), (vx, vy) = grid.u_faces(), grid.v_faces()
    array = np.stack([push(ux, uy, 0.05)[0], push(vx, vy, 0.05)[1]], axis=-1)
    field = device.upload(array.astype(np.float32))
    for forces in (push, array, [array], (field, 0.1), [(field, 0.1)], [0.5 * array, (field, 0.05)]):
        fluid = Fluid(device, grid)
        fluid.step(0.1, forces)
        found.append(fluid.u)
        fluid.release()
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], atol=1e-5)
    assert np.abs(found[0]).max() > 1e-3


@pytest.mark.parametrize("kind", [Fluid, PaperFluid])
def test_what_is_of_no_use_is_told_in_a_sentence(device: Device, kind: type[Fluid | PaperFluid]) -> None:
    """Nothing at all or a word where something else is wanted: an error of ours."""
    grid = Grid(16, 12)
    fluid, warp, own = kind(device, grid), WarpMap(device, grid), Fluid(device, grid)
    still, nothing = np.zeros((12, 16, 2)), cast(Any, None)
    calls: list[Callable[[Any], object]] = [
        fluid.step,
        lambda wrong: fluid.step(0.1, [wrong]),
        lambda wrong: fluid.step(0.1, wrong),
        lambda wrong: fluid.step(0.1, (), wrong or cast(Any, 3)),
        lambda wrong: fluid.add_force(still, wrong),
        fluid.advect,
        fluid.diffuse,
        fluid.set_velocity,
        fluid.set_viscosity,
        fluid.set_solid,
        fluid.restore,
        fluid.add_source,
        fluid.add_local,
        lambda wrong: fluid.add_source(fluid.solid, wrong),
        own.trace,
        lambda wrong: warp.follow(wrong, 0.1),
        lambda wrong: warp.follow(own, wrong),
        lambda wrong: warp.advance(wrong, 0.1),
        lambda wrong: warp.advance_prescribed(wrong, 0.1),
        lambda wrong: warp.advance_prescribed(still, wrong),
        lambda wrong: warp.advance_prescribed(still, 0.1, wrong),
        warp.set,
        warp.restore,
        warp.at,
        lambda wrong: warp.read(wrong or cast(Any, (3, 4, 5))),
        lambda wrong: Grid(wrong, 16),
        lambda wrong: Grid.for_picture(wrong, 16, 64),
        lambda wrong: Fluid(wrong, grid),
        lambda wrong: Fluid(own.device, wrong),
        lambda wrong: Fluid(own.device, grid, wrong or cast(Any, Walls())),
        lambda wrong: FluidParams(wrong),
        lambda wrong: FluidParams(drag=wrong),
        lambda wrong: Walls(speed=wrong),
        own.flow_on,
        own.lay_on,
        own.go_on_with,
        lambda wrong: Brush(device).push(wrong, Tip((0.3, 0.3), (0.3, 0.3), 0.1), 0.1),
        lambda wrong: Brush(device).push(fluid, wrong, 0.1),
        lambda wrong: Brush(device).lead(fluid, wrong),
        lambda wrong: Brush(device).make_up(fluid, Push(Tip((0.3, 0.3), (0.3, 0.3), 0.1), 0.1), wrong),
        lambda wrong: Push(Tip((0.3, 0.3), (0.3, 0.3), 0.1), 0.1, local=wrong),
        lambda wrong: Push(Tip((0.3, 0.3), (0.3, 0.3), 0.1), 0.1, hold=wrong),
        lambda wrong: Tip((0.3, 0.3), (0.3, 0.3), wrong),
        lambda wrong: Tip((0.3, 0.3), (0.3, 0.3), 0.1, others=(wrong,)),
        lambda wrong: Handle(wrong),
        lambda wrong: Handle((0.3, 0.3), radius=wrong),
        lambda wrong: Handles(fluid, warp, [wrong]),
        lambda wrong: Handles(wrong, warp, []),
        lambda wrong: Handles(fluid, wrong, []),
        lambda wrong: Density(device, wrong),
        lambda wrong: Density(device, np.ones((12, 16))).advance(wrong, grid, 0.1),
        Density(device, np.ones((12, 16))).restore,
        Masks(device, grid).restore,
        Handles(fluid, warp, []).restore,
        lambda wrong: Masks(device, wrong),
        lambda wrong: Masks(device, grid).set_base(wrong),
        lambda wrong: Masks(device, grid).apply(wrong),
        lambda wrong: Masks(device, grid).thicken(wrong, 1.0),
        lambda wrong: Sampler(device).apply(warp, wrong),
        lambda wrong: Sampler(device).apply(wrong, np.zeros((6, 6), np.uint8)),
        warp.move_to,
        lambda wrong: WarpMap(device, wrong),
        lambda wrong: WarpMap(wrong, grid),
        lambda wrong: WarpMap(device, grid, wrong or cast(Any, 8)),
        lambda wrong: WarpMap(device, grid, (wrong, 16)),
        lambda wrong: WarpMap(device, grid, (16, 5)),
        lambda wrong: WarpMap(device, grid, remap_every=wrong),
        lambda wrong: warp.hold(wrong or cast(Any, still)),
        device.upload,
    ]
    for call in calls:
        for wrong in (nothing, cast(Any, "x")):
            with pytest.raises((TypeError, ValueError), match=r"wanted|must be"):
                call(wrong)
    for wrong in (nothing, cast(Any, Walls())):
        with pytest.raises(TypeError, match=r"how a step is made is .*wanted"):
            fluid.params = wrong
    assert np.array_equal(fluid.velocity_at_centres(), still)
    for item in (fluid, warp, own):
        item.release()


def test_handles_may_come_one_by_one_and_a_step_be_a_fraction(fluid: Any) -> None:
    warp = WarpMap(fluid.device, fluid.grid)
    handles = Handles(fluid, warp, (Handle((x, 0.3), (x, 0.35)) for x in (0.3, 0.6)))
    assert len(handles.handles) == 2
    handles.advance(cast(Any, Fraction(1, 50)))
    assert np.abs(warp.read()).max() > 0
    warp.release()


def test_a_function_may_work_in_place_and_give_the_same_arrays_again(device: Device) -> None:
    """Its first component is taken on left faces, its second on upper ones; a map's path has four places and times."""
    grid, given = Grid(20, 12), (np.zeros((12, 20)), np.zeros((12, 20)))

    def anew(x: np.ndarray, y: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        return np.sin(5 * (x - 0.5)), x * np.cos(4 * y)

    def again(x: np.ndarray, y: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        np.multiply(x, np.cos(4 * y), out=given[1])
        x -= 0.5
        np.sin(5 * x, out=given[0])
        return given

    found = []
    for function in (anew, again):
        fluid, paper, warp = Fluid(device, grid), PaperFluid(device, grid), WarpMap(device, grid)
        fluid.set_velocity(function)
        fluid.add_force(function, 0.1)
        paper.set_velocity(function)
        warp.advance_prescribed(function, 0.1)
        found.append((fluid.u, fluid.v, paper.velocity_at_centres(), warp.read()))
        for item in (fluid, paper, warp):
            item.release()
    for other, wanted in zip(found[1], found[0], strict=True):
        np.testing.assert_array_equal(other, wanted)


@pytest.mark.parametrize("kind", [list, np.array])
def test_a_place_may_be_a_tuple_or_a_list_or_an_array(device: Device, kind: Callable[[Any], Any]) -> None:
    grid, found = Grid(20, 12), []
    for made in (tuple, kind):
        start, end = made((0.3, 0.2)), made((0.4, 0.25))
        tip = Tip(start, end, 0.15, others=(TipPath(end, start, True),))
        fluid, warp, masks, brush = Fluid(device, grid), WarpMap(device, grid), Masks(device, grid), Brush(device)
        masks.thicken(tip, 1.0)
        brush.push(fluid, tip, 0.1)
        fluid.step(0.1)
        warp.set(np.full((12, 20, 2), 0.02))
        warp.restore_under(start, 0.1)
        found.append((fluid.faces().get(), warp.read(), masks.thickness.get()))
        for item in (fluid, warp, masks):
            item.release()
    for other, wanted in zip(*found, strict=True):
        assert np.ptp(wanted) > 0
        np.testing.assert_array_equal(other, wanted)


def test_arrays_of_any_layout_are_the_same_numbers(device: Device) -> None:
    grid, found = Grid(20, 12), []
    array = reference.smooth_velocity(20, 12, seed=3).astype(np.float32)
    spread = np.zeros((24, 40, 2), np.float32)
    spread[::2, ::2] = array
    turned = np.ascontiguousarray(array.transpose(1, 0, 2)).transpose(1, 0, 2)
    for given in (array, array.tolist(), array.astype(">f4"), array.astype(">f8"), spread[::2, ::2], turned):
        fluid = Fluid(device, grid)
        fluid.set_velocity(cast(Any, given))
        found.append(fluid.faces().get())
        fluid.release()
    assert found[0].any()
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])


def test_devices_beside_each_other_do_not_mix(device: Device) -> None:
    """Each draws in its own context, whichever was made or used last; a field of another one is refused."""

    def stirred(where: Device) -> Fluid:
        fluid = Fluid(where, Grid(20, 12))
        fluid.set_velocity(reference.smooth_velocity(20, 12, seed=2))
        return fluid

    alone = stirred(device)
    alone.step(0.1)
    wanted = alone.u
    with Device.headless() as other:
        here, there = stirred(device), stirred(other)
        for fluid in (here, there):
            fluid.step(0.1)
            np.testing.assert_array_equal(fluid.u, wanted)
        force = other.upload(np.ones((12, 20, 2)))
        for forces in ([(force, 0.1)], [(device.upload(np.ones((12, 20, 2))), 0.1), (force, 0.1)]):
            with pytest.raises(FieldError, match="another device"):
                here.step(0.1, forces)
            np.testing.assert_array_equal(here.u, wanted)
            assert here.impulse.is_empty
        with pytest.raises(FieldError, match="another device"):  # it would be drawn into some texture of this one
            Brush(device).expand(there, Tip((0.3, 0.3), (0.3, 0.3), 0.1), 1.0)
        steered = Brush(device), Push(Tip((0.3, 0.3), (0.4, 0.3), 0.1), 0.1)
        with pytest.raises(FieldError, match="another device"):
            there.step(0.1, (), lambda faces: steered[0].make_up(there, steered[1], faces))
    other.release()  # which the block has done
    here.step(0.1)
    assert np.isfinite(here.u).all()
    with pytest.raises(ContextError, match="released"):
        there.step(0.1)
    here.release()
    alone.release()


def test_a_device_works_in_its_own_thread_and_process_only(fluid: Fluid) -> None:
    """In another thread GL would draw nothing, in a forked process it would wait for ever."""
    before, time = fluid.u, fluid.time

    def is_refused() -> bool:
        try:
            fluid.step(0.1)
        except ContextError as error:
            return "thread and the process" in str(error)
        return False

    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(is_refused).result()
    if "fork" in multiprocessing.get_all_start_methods():
        child = multiprocessing.get_context("fork").Process(target=lambda: sys.exit(not is_refused()))
        child.start()
        child.join()
        assert child.exitcode == 0
    assert fluid.time == time
    np.testing.assert_array_equal(fluid.u, before)
    fluid.step(0.1)
    assert not np.array_equal(fluid.u, before)


def test_what_was_released_says_so(device: Device) -> None:
    fluid, warp = Fluid(device, Grid(20, 12)), WarpMap(device, Grid(20, 12))
    state = fluid.save()
    calls: list[Callable[[], object]] = [
        lambda: fluid.step(0.1),
        lambda: fluid.u,
        lambda: fluid.set_viscosity(1.0),
        lambda: fluid.restore(state),
        lambda: warp.follow(fluid, 0.1),
        lambda: warp.read(),
    ]
    for thing in (fluid, warp, state, fluid, warp):  # again, which does nothing
        thing.release()
    for call in calls:
        with pytest.raises(FieldError, match="was released"):
            call()
    assert re.fullmatch(r"Fluid\(20 x 12 cells, t = 0 s, .* was released\)", repr(fluid))


def test_what_float32_cannot_hold_is_refused_in_a_sentence(device: Device):
    """And not by NumPy's warning about it."""
    grid = Grid(24, 16)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ValueError, match="velocity holds a value that is not finite"):
            Fluid(device, grid).set_velocity(np.full((16, 24, 2), 1e39))
        with pytest.raises(ValueError, match="not finite"):
            Fluid(device, grid).step(0.1, lambda x, y, t: (0 * x + 1e39, y))
        with pytest.raises(ValueError, match="beyond"):
            Fluid(device, grid).step(1e4, np.full((16, 24, 2), 1e35))
