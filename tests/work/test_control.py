"""Forces in the fluid: areas grow as the source says, push and twirl keep them, and no grid changes a warp."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.model.schema import frozen
from app.model.timelaws import Instants
from app.work.loaded_forces import LoadedForce
from app.work.replay import Replay
from solver.gl.device import Device
from solver.warp.distortion import MapStatistics

BLACK = np.zeros((200, 300, 3), np.uint8)


def warp_of(
    device: Device, *forces: dict[str, Any], cells: int = 128, dt: float = 1 / 60, pixels: np.ndarray = BLACK
) -> tuple[np.ndarray, MapStatistics]:
    """The displacement after half a second, at 1536 x 1024 places, in longer sides, and the map's statistics."""
    fluid = {"grid": cells, "dt": dt, "viscosity": 1e-3}
    recipe = Recipe.model_validate(frozen({"duration": 0.5, "fluid": fluid, "force": list(forces)}))
    replay = Replay(device, recipe, Pictures(Picture(pixels)), budget=0)
    try:
        for _ in range(recipe.ticks):
            replay.advance()
        return replay.warp.read((1536, 1024)).astype(np.float64), replay.warp.statistics()
    finally:
        replay.release()


def area_of_disc(displacement: np.ndarray, radius: float) -> float:
    """The area that a disc of the original in the middle takes in the result."""
    height, width = displacement.shape[:2]
    h = 1 / width
    x, y = np.meshgrid((np.arange(width) + 0.5) * h, (np.arange(height) + 0.5) * h)
    r = np.hypot(x + displacement[..., 0] - 0.5, y + displacement[..., 1] - height * h / 2)
    # The edge counts in part: a cut through the pixels that is as steep as the map makes it.
    steepness = np.maximum(np.linalg.norm(np.gradient(r, h), axis=0), 0.1) * h
    return float(np.clip(0.5 + (radius - r) / steepness, 0, 1).sum() * h * h)


@pytest.mark.parametrize(("kind", "sign"), [("source", 1), ("sink", -1)])
@pytest.mark.parametrize("law", [{"at": 0.0}, {"during": [0.0, 0.5]}, {"formula": "2*sin(pi*t/0.5)**2"}])
def test_the_area_of_a_disc_grows_as_the_source_says(kind: str, sign: int, law: dict[str, Any], device: Device) -> None:
    strength, radius, disc = (0.3, 0.25, 0.05) if "at" in law else (0.6, 0.25, 0.05)
    displacement, found = warp_of(
        device, {"kind": kind, "point": [0.5, 0.5], "radius": radius, "strength": strength, **law}
    )
    before = math.pi * disc**2
    # dr/dt = s(t) r / 2 (1 - r^2/R^2)^3 is the flow through the circle that the disc's edge has become.
    r, steps = disc, 2000
    for _ in range(steps):
        r += sign * 0.3 / steps * r / 2 * (1 - (r / radius) ** 2) ** 3
    assert area_of_disc(displacement, disc) - before == pytest.approx(math.pi * r**2 - before, rel=0.01)
    assert found.folds == 0


@pytest.mark.parametrize(
    "force",
    [
        {"kind": "vortex", "point": [0.5, 0.5], "radius": 0.25, "strength": 6.0},
        {"kind": "point", "point": [0.45, 0.5], "direction": [1, 0.4], "radius": 0.15, "strength": 0.4},
    ],
)
def test_push_and_twirl_keep_areas(force: dict[str, Any], device: Device) -> None:
    displacement, found = warp_of(device, force)
    assert found.displacement_max > 0.03
    # Of all that the tool reaches; within it, what the projection has left over moves area about a little.
    for disc, allowed in ((0.29, 1e-3), (0.06, 1e-2)):
        assert area_of_disc(displacement, disc) == pytest.approx(math.pi * disc**2, rel=allowed)


@pytest.mark.parametrize("law", [{"at": 0.0, "strength": 0.05}, {"during": [0.0, 0.4], "strength": 0.125}])
def test_a_local_force_moves_by_its_strength_what_is_under_it(law: dict[str, Any], device: Device) -> None:
    point = {"kind": "point", "point": [0.5, 0.5], "direction": [0, 1], "radius": 0.15, "local": 1.0}
    displacement, found = warp_of(device, {**point, **law})
    height, width = displacement.shape[:2]
    y = (np.arange(height) + 0.5 - height / 2) / width
    # dy/dt = 0.05 (1 - y^2 / R^2)^3, for a second, from the middle.
    moved, steps = 0.0, 2000
    for _ in range(steps):
        moved += 0.05 / steps * (1 - (moved / 0.15) ** 2) ** 3
    assert np.interp(0.0, y + displacement[:, width // 2, 1], y) == pytest.approx(moved, rel=0.03)
    # But for what the map's interpolation reaches, nothing moves beyond the radius.
    x = (np.arange(width) + 0.5) / width - 0.5
    assert not displacement[np.hypot(x, y[:, None]) > 0.15 + 4 / 128].any()
    assert found.folds == 0


def test_a_force_means_the_same_at_every_grid_and_dt(device: Device) -> None:
    force = {"kind": "curve", "points": [[0.2, 0.4], [0.6, 0.5]], "radius": 0.12, "strength": 0.3, "at": [0.0, 0.2]}
    reference, _ = warp_of(device, force, cells=256)
    coarse, _ = warp_of(device, force, cells=128)
    assert np.linalg.norm(coarse - reference, axis=-1).mean() * 512 < 0.5
    long_steps, _ = warp_of(device, force, dt=1 / 30)
    assert np.linalg.norm(long_steps - coarse, axis=-1).mean() * 512 < 1.0


def test_a_gradient_alone_moves_nothing_in_a_uniform_fluid(device: Device) -> None:
    x, y = np.meshgrid(np.arange(300), np.arange(200))
    disc = np.where(np.hypot(x - 149.5, y - 99.5) < 40, 255, 0).astype(np.uint8)[..., None]
    force = {"kind": "gradient", "segment": {"above": 0.5}, "blur": 0.08, "strength": 1.0, "during": [0.0, 0.5]}
    _, still = warp_of(device, force, pixels=disc)
    _, window = warp_of(device, {**force, "within": {"box": [0.3, 0.2, 0.5, 0.8], "soft": 0.05}}, pixels=disc)
    swollen, _ = warp_of(device, {**force, "strength": 0.05, "swell": True}, pixels=disc)
    assert still.displacement_max * 512 < 0.5
    assert window.displacement_max * 512 > 5
    assert area_of_disc(swollen, 40 / 300) > 1.1 * math.pi * (40 / 300) ** 2


@pytest.mark.parametrize(("name", "most"), [("strongest", 2.0 * 60), ("fastest", 2.0), ("widest", 3.0)])
def test_a_force_may_throw_by_two_pictures_a_tick_and_swell_by_three_e_folds(name: str, most: float) -> None:
    none = LoadedForce(
        "force[1]", Instants((0.0,)), faces=None, divergence=None, motion=None, strongest=0.0, widest=0.0, fastest=0.0
    )
    for part in (0.99, 1.01):
        force = replace(none, **{name: part * most})
        if part < 1:
            force.check(1.0, 1 / 60, 0.0)
        else:
            with pytest.raises(UserError, match=r"force\[1\]: at t = 0 s"):
                force.check(-1.0, 1 / 60, 0.0)
