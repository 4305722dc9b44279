"""What each tool does in a second: its absolute rate, its direction, and the part of it that pressure leaves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction

import numpy as np
import pytest

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.work.replay import Replay
from solver.brush.push import Push
from solver.brush.tip import Tip
from solver.gl.device import Device

TICKS, DT = 10, 0.02
HELD = (0, 1.0), (TICKS - 1, 1.0)
MIDDLE = np.array([[0.5, 0.375]])


@contextmanager
def replayed(
    device: Device, tool: str, *samples: tuple[int, float], viscosity: float = 0.01, **keys: object
) -> Iterator[Replay]:
    """A stroke in the middle of a picture of 4 : 3, held there in ticks with pressures; nothing is simulated yet."""
    told = {"tool": tool, "radius": 0.2, "hardness": 0.0, "samples": tuple((n, 0.5, 0.5, p) for n, p in samples)}
    fluid = {"grid": 64, "dt": DT, "viscosity": viscosity}
    recipe = Recipe.model_validate({"fluid": fluid, "stroke": (told | keys,)})
    replay = Replay(device, recipe, Pictures(Picture(np.zeros((96, 128, 3), np.uint8))))
    try:
        yield replay
    finally:
        replay.release()


@pytest.mark.parametrize("viscosity", [1e-3, 0.3])
@pytest.mark.parametrize(("pressure", "reverse", "rate"), [(1.0, False, 4.0), (0.5, False, 2.0), (1.0, True, -4.0)])
def test_twirl_turns_by_four_radians_a_second(
    device: Device, viscosity: float, pressure: float, reverse: bool, rate: float
) -> None:
    held = [(tick, pressure) for tick, _ in HELD]
    with replayed(device, "twirl", *held, viscosity=viscosity, reverse=reverse, hardness=1.0) as replay:
        replay.seek(TICKS)
        points = MIDDLE + np.array([[0.02, 0], [-0.02, 0]])
        right, left = points + replay.warp.at(points)
        across, down = right - left
        # Positive is clockwise on the screen; what is looked up comes from the other way.
        assert -math.atan2(down, across) / (TICKS * DT) == pytest.approx(rate, rel=0.1)


@pytest.mark.parametrize(("tool", "sign"), [("bloat", 1), ("pinch", -1)])
@pytest.mark.parametrize("pressure", [1.0, 0.25])
def test_bloat_doubles_its_exponent_in_a_second(device: Device, tool: str, sign: int, pressure: float) -> None:
    """Areas grow as e^(2 t), less what all of the picture gives for it: the brush's integral, pi r^2 / 4."""
    with replayed(device, tool, *((tick, pressure) for tick, _ in HELD)) as replay:
        replay.seek(TICKS)
        rate = -math.log(replay.warp.determinants(MIDDLE)[0]) / (TICKS * DT)
        assert rate == pytest.approx(sign * pressure * 2.0 * (1 - math.pi * 0.2**2 / 4 / 0.75), rel=0.01)


@pytest.mark.parametrize("tool", ["push", "twirl", "bloat", "pinch"])
@pytest.mark.parametrize("pressures", [(0.2, 0.6, 1.0), (1.0, 0.6, 0.2)], ids=["rising", "falling"])
def test_several_pressures_in_one_tick_carry_the_fluid_as_their_mean(
    device: Device, tool: str, pressures: tuple[float, ...]
) -> None:
    """Of each piece of the way that is the mean of its ends, and of the tick that of its pieces."""
    flows = []
    for each in (pressures, (0.6, 0.6, 0.6)):
        samples = tuple((0, x, 0.5, p) for x, p in zip((0.45, 0.5, 0.55), each, strict=True))
        with replayed(device, tool, (0, 1.0), samples=samples) as replay:
            replay.seek(1)
            flows.append(replay.fluid.velocity_at_centres())
    assert np.abs(flows[1]).max() > 1e-3
    assert np.abs(flows[0] - flows[1]).max() < 1e-5 * np.abs(flows[1]).max()


@pytest.mark.parametrize(("tool", "mask", "part"), [("freeze", "frozen", 1.0), ("thicken", "thickness", 0.5)])
def test_several_pressures_in_one_tick_paint_a_mask_piece_by_piece(
    device: Device, tool: str, mask: str, part: float
) -> None:
    """As in ticks of their own; what takes time has a part of the tick for each."""
    ways, painted = ((0, 0.3, 0.5, 0.0), (1, 0.5, 0.5, 0.4), (2, 0.7, 0.5, 1.0)), []
    for samples, strength in ((ways, part), (tuple((0, *rest) for _, *rest in ways), 1.0)):
        with replayed(device, tool, (0, 1.0), samples=samples, strength=strength, radius=0.05) as replay:
            replay.seek(3)
            painted.append(getattr(replay.masks, mask).get())
    row = painted[1][painted[1].shape[0] // 2]
    assert row[len(row) * 2 // 5] < row[len(row) * 3 // 5]
    assert np.abs(painted[0] - painted[1]).max() < 1e-3 * painted[1].max()


def test_a_push_faster_than_the_solver_follows_is_said_by_its_number(device: Device) -> None:
    """In ticks of a nanosecond, and so thick a fluid that nothing coasts."""
    stroke = {"tool": "push", "radius": 0.01, "samples": ((0, 0.1, 0.5, 1.0), (3, 0.9, 0.5, 1.0))}
    recipe = Recipe.model_validate({"fluid": {"dt": 1e-9, "viscosity": 1000}, "stroke": (stroke,), "duration": 4e-9})
    replay = Replay(device, recipe, Pictures(Picture(np.zeros((96, 128, 3), np.uint8))))
    said = r"stroke\[1\]: at 1e-09 s a push's speed of 1[.\d]+ was given; .*; let it take more ticks, or make"
    with pytest.raises(UserError, match=said):
        replay.seek(4)
    assert replay.tick == 0
    replay.release()


def test_a_curve_that_is_shorter_than_numbers_tell_blows_nothing(device: Device) -> None:
    """Its length over its speed was a time whose inverse is infinite."""
    with replayed(device, "curve", (0, 1.0), samples=((0, 0.0, 0.5, 1.0), (0, 1e-310, 0.5, 1.0))) as replay:
        replay.seek(TICKS)
        assert not replay.warp.read().any()


def test_a_curve_blows_at_half_a_side_a_second(device: Device) -> None:
    samples = ((0, 0.3, 0.5, 1.0), (0, 0.7, 0.5, 1.0))
    with replayed(device, "curve", (0, 1.0), viscosity=1e-4, samples=samples) as replay:
        replay.seek(1)
        assert replay.fluid.velocity_at_centres()[24, 28:36, 0] == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize(("viscosity", "drag"), [(0.3, 0.0), (0.0065, 0.0)])
def test_a_push_that_holds_carries_the_picture_as_far_as_it_goes_and_folds_nothing(
    viscosity: float, drag: float, device: Device
) -> None:
    """Six radii; one that does not hold leaves behind by and by what it has taken along, and half of it is between."""
    radius, end, carried = 0.05, 0.8, list[float]()
    for hold in (0.0, 0.5, 1.0):
        samples = tuple((tick, 0.5 + (end - 0.5) * tick / 36, 0.5, 1.0) for tick in range(37))
        push = {"tool": "push", "hold": hold, "radius": radius, "samples": samples}
        fluid = {"grid": 96, "dt": 1 / 30, "viscosity": viscosity, "drag": drag}
        recipe = Recipe.model_validate({"fluid": fluid, "stroke": (push,)})
        replay = Replay(device, recipe, Pictures(Picture(np.zeros((400, 600, 3), np.uint8))))
        try:
            replay.seek(38)
            ahead = np.stack([end + np.linspace(-1, 1, 81) * radius, np.full(81, 1 / 3)], axis=-1)
            carried.append(float(-replay.warp.at(ahead)[:, 0].min()) / radius)
            assert replay.warp.statistics().folds == 0
        finally:
            replay.release()
    smeared, half, whole = carried
    assert smeared < 1
    assert smeared < 0.75 * half < 0.5 * whole
    assert whole == pytest.approx(6, rel=0.05)


@pytest.mark.parametrize(("viscosity", "drag", "ticks"), [(0.3, 0.0, 12), (0.3, 0.0, 7), (0.03, 2.0, 12)])
def test_a_quick_push_that_holds_carries_the_picture_too(
    viscosity: float, drag: float, ticks: int, device: Device
) -> None:
    """Six radii at half a radius a tick, and at most of one: where a tick begins the fluid moves as its end will."""
    radius, end = 0.05, 0.8
    samples = tuple((tick, 0.5 + (end - 0.5) * tick / ticks, 0.5, 1.0) for tick in range(ticks + 1))
    push = {"tool": "push", "hold": 1.0, "radius": radius, "samples": samples}
    fluid = {"grid": 96, "dt": 1 / 30, "viscosity": viscosity, "drag": drag}
    recipe = Recipe.model_validate({"fluid": fluid, "stroke": (push,)})
    replay = Replay(device, recipe, Pictures(Picture(np.zeros((400, 600, 3), np.uint8))))
    replay.seek(ticks + 1)
    carried = float(-replay.warp.at(np.array([[end, 1 / 3]]))[0, 0]) / radius
    assert carried == pytest.approx(6, rel=0.05)
    replay.release()


def test_a_push_of_a_radius_a_tick_folds_nothing(device: Device) -> None:
    """Along such a way the velocity changes so much that one step of the midpoint rule would press the map to lines."""
    push = {"tool": "push", "radius": 0.045, "samples": ((0, 0.78, 0.107, 1.0), (12, 0.883, 0.762, 1.0))}
    fluid = {"grid": 96, "viscosity": 0.0065, "drag": 0.0}
    recipe = Recipe.model_validate({"fluid": fluid, "stroke": (push,)})
    replay = Replay(device, recipe, Pictures(Picture(np.zeros((620, 900, 3), np.uint8))))
    for tick in (2, 12, 30):
        replay.seek(tick)
        assert replay.warp.statistics().det_min > 0.3
    replay.release()


@pytest.mark.parametrize("grid", [341, 682])
def test_a_local_push_of_half_a_radius_a_tick_folds_nothing(grid: int, device: Device) -> None:
    """It has steeper sides than a flow, and the ways along which the picture is carried must not cross there."""
    samples = ((0, 0.5, 0.44, 1.0), (4, 0.5, 0.56, 1.0))
    push = {"tool": "push", "local": 1.0, "radius": 0.04, "hardness": 0.5, "samples": samples}
    fluid = {"grid": grid, "viscosity": 0.3, "drag": 0.0}
    recipe = Recipe.model_validate({"fluid": fluid, "stroke": (push,)})
    replay = Replay(device, recipe, Pictures(Picture(np.zeros((1000, 1500, 3), np.uint8))))
    replay.seek(6)
    assert replay.warp.statistics().det_min > 0.05
    assert replay.warp.statistics().displacement_max > 0.04
    replay.release()


@pytest.mark.parametrize(("radius", "step"), [(0.3, 0.25), (0.3, 1.0), (0.15, 2.0)])
def test_a_quick_hard_local_push_folds_nothing_and_carries_as_far(radius: float, step: float, device: Device) -> None:
    """Of a rim of a tenth of the radius, pushed on by one and more in a tick, nothing would be left."""
    samples = tuple((n, 0.5 + step * radius * (n - 1.5), 0.5, 1.0) for n in range(4))
    push = {"tool": "push", "local": 1.0, "radius": radius, "hardness": 1.0, "samples": samples}
    recipe = Recipe.model_validate({"fluid": {"grid": 64, "viscosity": 0.3, "drag": 0.0}, "stroke": (push,)})
    replay = Replay(device, recipe, Pictures(Picture(np.zeros((256, 256, 3), np.uint8))))
    replay.seek(2)
    assert replay.warp.statistics().displacement_max > 0.9 * min(step, 1) * radius
    for tick in (2, 4):
        replay.seek(tick)
        assert replay.warp.statistics().det_min > 0
    replay.release()


def test_a_local_push_is_at_most_fully_hard() -> None:
    slow = Push(Tip((0.5, 0.5), (0.5001, 0.5), 0.3, hardness=3.0), 1 / 60, local=1.0)
    assert slow.local_hardness == 1.0


@pytest.mark.parametrize("slant", [0.0, 0.1])
def test_a_local_push_into_something_frozen_presses_what_it_brings_together_smoothly(
    device: Device, slant: float
) -> None:
    """From both sides, and slanting, against a bar: nothing folds."""
    bar = {"tool": "freeze", "radius": 0.03, "samples": ((0, 0.5 - slant, 0.25, 1.0), (2, 0.5 + slant, 0.75, 1.0))}
    towards, along = ((3, 0.3, 0.4, 1.0), (20, 0.5, 0.55, 1.0)), ((24, 0.6, 0.35, 1.0), (40, 0.5, 0.6, 1.0))
    pushes = tuple({"tool": "push", "local": 1.0, "radius": 0.08, "samples": way} for way in (towards, along))
    fluid = {"grid": 96, "viscosity": 0.3, "drag": 0.0}
    recipe = Recipe.model_validate({"fluid": fluid, "stroke": (bar, *pushes)})
    replay = Replay(device, recipe, Pictures(Picture(np.zeros((620, 900, 3), np.uint8))))
    for tick in (22, 42):
        replay.seek(tick)
        assert replay.warp.statistics().folds == 0
    replay.release()


@pytest.mark.parametrize(("radius", "far", "ticks"), [(0.06, 0.2, 30), (0.12, 0.3, 20), (0.09, 0.15, 6)])
def test_a_push_moves_a_fluid_that_nothing_slows_down(device: Device, radius: float, far: float, ticks: int) -> None:
    """Slow or a flick, it takes the picture along, and neither it nor the next half a second folds it."""
    samples = (0, 0.5 - far / 2, 0.5, 1.0), (ticks, 0.5 + far / 2, 0.5, 1.0)
    push = {"tool": "push", "radius": radius, "samples": samples}
    fluid = {"grid": 96, "viscosity": 0.0, "drag": 0.0}
    recipe = Recipe.model_validate({"fluid": fluid, "stroke": (push,)})
    replay = Replay(device, recipe, Pictures(Picture(np.zeros((384, 512, 3), np.uint8))))
    replay.seek(ticks + 30)
    found = replay.warp.statistics()
    assert found.displacement_max > 0.5 * radius
    assert found.folds == 0
    replay.release()


@pytest.mark.parametrize(("tool", "rate"), [("thicken", 4.0), ("thin", -4.0)])
@pytest.mark.parametrize("pressures", [(1.0,), (0.5,), (1.0, 1.0, 1.0)], ids=str)
def test_thicken_paints_four_decades_a_second(
    device: Device, tool: str, rate: float, pressures: tuple[float, ...]
) -> None:
    """However many samples there are in a tick: with several, all of it in one."""
    first, ticks = pressures[0], 1 if len(pressures) > 1 else TICKS
    held = [(0, p) for p in pressures] if ticks == 1 else [(tick, first) for tick, _ in HELD]
    with replayed(device, tool, *held) as replay:
        replay.seek(ticks)
        viscosity = replay.fluid.viscosity.get()[23:25, 31:33]
        assert np.log10(viscosity / 0.01) / (ticks * DT) == pytest.approx(rate * first, rel=0.02)


@pytest.mark.parametrize("position", [TICKS, 1, Fraction(1, 3)])
@pytest.mark.parametrize("pressure", [1.0, 0.5])
def test_restore_takes_a_sixth_of_a_second_for_an_e_fold(
    device: Device, position: int | Fraction, pressure: float
) -> None:
    with replayed(device, "restore", *((tick, pressure) for tick, _ in HELD)) as replay:
        replay.warp.set(np.full((96, 128, 2), 0.05))
        replay.checkpoint()
        replay.seek(position)
        left = replay.warp.at(MIDDLE)[0] / 0.05
        assert left == pytest.approx(math.exp(-6.0 * pressure * float(position) * DT), rel=1e-3)


def test_freeze_and_thaw_act_at_once(device: Device) -> None:
    for pressure, frozen in ((1.0, True), (0.4, False)):
        with replayed(device, "freeze", (0, pressure)) as replay:
            replay.seek(1)
            assert bool(replay.fluid.solid.get()[24, 32]) is frozen
    with replayed(device, "thaw", (0, 1.0)) as replay:
        replay.masks.set_frozen(np.ones((replay.masks.canvas.ny, replay.masks.canvas.nx), bool))
        replay.seek(1)
        solid = replay.fluid.solid.get()
        assert not solid[24, 32]
        assert solid[0, 0]
