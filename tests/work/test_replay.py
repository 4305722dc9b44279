"""Replay: the state at a tick depends on the recipe alone, whatever the way there."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.model.handles import RecipeHandle, RecipePin
from app.model.picture import Picture
from app.model.recipe import FluidSettings, Recipe
from app.model.strokes import FINEST_DETAIL, Change, Sample, Stroke
from app.work.observation import whereabouts
from app.work.replay import Replay
from solver import energy
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.gl.field import FieldError
from solver.grid import Grid
from solver.resample.sampler import Sampler

RECIPE = Recipe.parse("""
duration = 1.0
[fluid]
grid = 32
dt = 0.025
viscosity = 0.002
[[force]]
kind = "vortex"
point = [0.5, 0.5]
strength = 2
[[stroke]]
tool = "push"
samples = [[3, 0.3, 0.3, 1], [12, 0.5, 0.4, 1]]
[[stroke]]
tool = "push"
local = 0.8
samples = [[4, 0.6, 0.6, 1], [9, 0.5, 0.7, 1]]
[[stroke]]
tool = "freeze"
samples = [[5, 0.8, 0.8, 1], [8, 0.85, 0.8, 1]]
[[stroke]]
tool = "thicken"
samples = [[8, 0.2, 0.8, 1], [14, 0.3, 0.8, 1]]
[[stroke]]
tool = "restore"
samples = [[16, 0.5, 0.7, 1], [18, 0.5, 0.7, 1]]
[[change]]
tick = 15
viscosity = 0.01
walls = "no-slip"
""")
LAST = 20


def pictures() -> Pictures:
    pixels = np.random.default_rng(0).integers(0, 256, (60, 80, 3), np.uint8)
    return Pictures(Picture(pixels))


@pytest.fixture
def replay(device: Device) -> Iterator[Replay]:
    replay = Replay(device, RECIPE, pictures())
    yield replay
    replay.release()


def test_a_grid_that_the_graphics_device_cannot_hold_is_refused_in_a_sentence(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was told as a bug: the texture that moves are read from is twice as high as the grid, with a border."""
    monkeypatch.setattr(device, "limits", replace(device.limits, max_texture_size=1024))
    square = Pictures(Picture(np.zeros((60, 60, 3), np.uint8)))
    most = Replay(device, RECIPE.on_grid(510), square)
    most.advance()
    most.release()
    with pytest.raises(UserError, match=r"^a grid of 511 x 511 cells is more than this .*; use a smaller --grid or"):
        Replay(device, RECIPE.on_grid(511), square)


def test_a_fault_of_a_field_is_not_told_as_that_of_what_acts(replay: Replay) -> None:
    """It read "stroke[1]: at 0.075 s impulse was released; let it take more ticks", as of a speed."""
    replay.seek(3)
    for field in (replay.fluid.impulse.field, replay.forces[0].faces):
        assert field is not None
        field.release()
        with pytest.raises(FieldError, match=f"^{re.escape(field.label)} was released$"):
            replay.advance()
        replay.seek(0)
        replay.use(RECIPE.edited(stroke=()))


def moment(replay: Replay) -> bytes:
    return b"".join(array.tobytes() for array in replay.snapshot().values()) + replay.warp.read().tobytes()


@pytest.fixture(scope="module")
def moments(shared_device: Device) -> list[bytes]:
    """Every tick of `RECIPE`, by a straight run without going back."""
    replay = Replay(shared_device, RECIPE, pictures(), budget=0)
    seen = [moment(replay)]
    for _ in range(LAST):
        replay.advance()
        seen.append(moment(replay))
    replay.release()
    return seen


def test_going_back_past_a_change_of_viscosity_takes_what_masks_are_painted_on_along(
    replay: Replay, moments: list[bytes]
):
    """A brush thickens at ticks 8 to 14, and at 15 all of the fluid becomes thicker."""
    for tick in range(LAST + 1):
        replay.seek(tick)
        replay.checkpoint()
    for tick in range(LAST, 0, -1):
        replay.seek(tick - 1)
        replay.advance()
        assert moment(replay) == moments[tick]


def test_going_anywhere_gives_the_same_bytes(replay: Replay, moments: list[bytes]):
    rng = random.Random(1)
    for _ in range(4):
        if rng.random() < 0.3:
            replay.seek(Fraction(rng.randrange(2 * LAST), 3))
        tick = rng.randrange(LAST + 1)
        replay.seek(tick)
        assert replay.tick == tick
        assert moment(replay) == moments[tick]


def test_from_a_moment_where_the_walls_change_it_goes_on_with_the_same_bytes(device: Device) -> None:
    """The step after uses a trace between the new walls, whether or not the one before has left it another."""
    push = Stroke(tool="push", radius=0.3, samples=((0, 0.2, 0.1, 1.0), (6, 0.7, 0.1, 1.0)))
    change = (Change(tick=4, walls="no-slip"), Change(tick=6, walls="free-slip"))
    recipe = Recipe(stroke=(push,), change=change, duration=0.2, fluid=FluidSettings(grid=24, viscosity=1e-4))
    replay = Replay(device, recipe, pictures(), budget=0)
    straight, kept = [moment(replay)], [replay.snapshot()]
    for _ in range(9):
        replay.advance()
        straight.append(moment(replay))
        kept.append(replay.snapshot())
    for start, snapshot in enumerate(kept[:-1]):
        replay.resume(start, snapshot)
        for tick in range(start + 1, min(start + 3, 10)):
            replay.advance()
            assert moment(replay) == straight[tick], (start, tick)
    replay.release()


@pytest.mark.parametrize("later", ["freeze", "thicken"])
def test_smoothing_is_the_same_before_and_after_a_mask_has_been_painted(later: str, device: Device) -> None:
    """Which the recipe does only after it."""
    smooth = Stroke(tool="smooth", radius=0.2, samples=((4, 0.4, 0.4, 1.0), (5, 0.5, 0.4, 1.0)))
    painted = smooth.model_copy(update={"tool": later, "samples": ((7, 0.4, 0.4, 1.0), (8, 0.5, 0.4, 1.0))})
    replay = Replay(device, RECIPE.edited(stroke=(RECIPE.stroke[0], smooth, painted)), pictures())
    replay.seek(3)
    replay.checkpoint()
    replay.seek(6)
    first = moment(replay)
    replay.seek(9)
    replay.seek(3)
    replay.seek(6)
    assert moment(replay) == first
    replay.release()


def test_undo_and_redo_give_the_same_bytes(replay: Replay, moments: list[bytes]):
    shorter = RECIPE.edited(stroke=RECIPE.stroke[:1])
    replay.seek(LAST)
    replay.use(shorter)
    without = moment(replay)
    assert without != moments[LAST]
    replay.use(RECIPE)
    assert moment(replay) == moments[LAST]
    replay.use(shorter)
    assert moment(replay) == without


def test_a_live_session_is_the_same_as_its_recording(replay: Replay, moments: list[bytes]):
    """The editor's way: every stroke grows by a sample a tick, just before that tick is made."""
    live = RECIPE.edited(stroke=())
    replay.use(live)
    for tick in range(LAST):
        strokes = tuple(until(stroke, tick) for stroke in RECIPE.stroke if stroke.first_tick <= tick)
        replay.use(live.edited(stroke=strokes))
        replay.advance()
    assert moment(replay) == moments[LAST]


def until(stroke: Stroke, tick: int) -> Stroke:
    """The stroke as far as it had been drawn at `tick`, with a sample in every tick."""
    samples = [(n, *stroke.at(n)[-1][2:4], 1.0) for n in range(stroke.first_tick, min(tick, stroke.last_tick) + 1)]
    return stroke.model_copy(update={"samples": tuple(samples)})


def test_another_grid_starts_anew(replay: Replay):
    replay.seek(6)
    replay.use(Recipe.parse("[fluid]\ngrid = 32"))
    assert replay.tick == 6
    assert replay.grid.nx == 32


def test_checkpoints_stay_within_their_budget(device: Device):
    replay = Replay(device, RECIPE, pictures(), budget=2**40)
    try:
        for tick in (LAST, 3, 17, LAST):
            replay.seek(tick)
        whole = replay.checkpoints.nbytes
    finally:
        replay.release()
    budget = whole * 3 // 4  # the largest moment is half of all
    replay = Replay(device, RECIPE, pictures(), budget=budget)
    try:
        for tick in (LAST, 3, 17, LAST):
            replay.seek(tick)
            assert replay.checkpoints.nbytes <= budget
        assert len(replay.checkpoints) >= 2
    finally:
        replay.release()


def test_between_two_ticks_the_map_is_between_them(replay: Replay):
    """A third of the way it has moved a third, up to second order."""
    maps = []
    for position in (10, Fraction(31, 3), 11):
        replay.seek(position)
        maps.append(replay.warp.read())
    whole, part = np.abs(maps[2] - maps[0]).max(), maps[1] - maps[0]
    assert whole > 1e-4
    assert np.abs(part - (maps[2] - maps[0]) / 3).max() < 0.02 * whole


def test_the_cells_that_are_told_as_closed_are_those_that_are_wholly(device: Device):
    """Of a soft and slanted path some are closed in part: the fluid goes through them."""
    freeze = "[[freeze]]\nkind = 'path'\npoints = [[0.2, 0.3], [0.7, 0.8]]\nradius = 0.1\nhardness = 0.2\n"
    recipe = Recipe.parse(f"[fluid]\ngrid = 32\n{freeze}")
    replay = Replay(device, recipe, pictures())
    parts = replay.fluid.solid.get() / 255
    assert ((parts >= 0.5) & (parts < 1)).sum() > 10
    np.testing.assert_array_equal(replay.solid, parts == 1)
    replay.release()


def test_pins_are_led_before_handles_each_in_the_order_of_the_recipe(device: Device):
    """By number, of which the tenth does not come before the second; and what is muted keeps its own."""
    places = [(0.05 * number, 0.5) for number in range(1, 13)]
    handles = tuple(RecipeHandle(at=at, to=at, muted=number == 4) for number, at in enumerate(places, 1))
    recipe = Recipe(handle=handles, pin=tuple(RecipePin(at=at) for at in places[:3]), fluid=FluidSettings(grid=16))
    replay = Replay(device, recipe, pictures(), budget=0)
    told = [
        *(f"pin[{number}]" for number in (1, 2, 3)),
        *(f"handle[{number}]" for number in range(1, 13) if number != 4),
    ]
    assert [label for label, _ in replay.led] == told
    np.testing.assert_allclose(
        replay.handles.places / replay.grid.extent, [*places[:3], *places[:3], *places[4:]], atol=1e-6
    )
    replay.release()


def test_changes_act_at_their_tick(device: Device):
    recipe = Recipe.parse(
        "[fluid]\ngrid = 32\n[[force]]\nkind = 'vortex'\npoint = [0.5, 0.5]\nstrength = 8\nat = [0, 0.11]\n"
        "[[change]]\ntick = 5\nclear_velocity = true\nreset_warp = true"
    )
    replay = Replay(device, recipe, pictures())
    try:
        replay.seek(5)
        assert np.abs(replay.warp.read()).max() > 0.01
        replay.seek(6)
        assert np.abs(replay.warp.read()).max() < 1e-6
        assert replay.fluid.motion().largest_speed < 1e-6
        replay.seek(9)  # the second impulse is behind it, and nothing is taken back any more
        assert np.abs(replay.warp.read()).max() > 0.01
    finally:
        replay.release()


def test_settings_are_those_of_their_tick(device: Device):
    """A change at tick 5 holds in the step from 5 to 6 and in all that follow."""
    text = "[fluid]\ngrid = 32\nviscosity = 0.01\ndrag = 1.5\n[[change]]\ntick = 5\nviscosity = 0.02\ndrag = 3.0\n"
    recipe = Recipe.parse(text + 'walls = "no-slip"\n[[change]]\ntick = 7\nwalls = "free-slip"')
    replay = Replay(device, recipe, pictures(), budget=0)
    for tick, viscosity, drag, walls in ((5, 0.01, 1.5, "free"), (6, 0.02, 3.0, "none"), (8, 0.02, 3.0, "free")):
        replay.seek(tick)
        assert (replay.fluid.viscosity.get() == np.float32(viscosity)).all()
        assert (replay.fluid.params.drag, replay.fluid.params.walls.slip) == (drag, walls)
        assert recipe.fluid_at(tick - 1).drag == drag
    replay.release()


def test_the_start_is_what_it_was_before_anything_changed(device: Device):
    """Also with a change in the first tick, which comes with its step, and gone back to from behind a later one."""
    plain, replay = Replay(device, RECIPE, pictures()), Replay(device, RECIPE, pictures(), budget=0)
    first = RECIPE.change[0].model_copy(update={"tick": 0})
    changed = Replay(device, RECIPE.edited(change=(first,)), pictures())
    try:
        replay.seek(LAST)
        replay.seek(0)
        assert moment(replay) == moment(plain)
        assert moment(changed) == moment(plain)
    finally:
        for item in (plain, replay, changed):
            item.release()


GRIDS = """
[fluid]
grid = {}
viscosity = 0.005
[[force]]
kind = "point"
point = [0.4, 0.5]
direction = [1, 0.3]
radius = 0.2
strength = 1.5
[[stroke]]
tool = "twirl"
radius = 0.2
samples = [[2, 0.6, 0.6, 1], [10, 0.6, 0.5, 1]]
"""


def test_grids_agree(device: Device):
    """The same recipe on three grids is the same warp, up to discretisation: the difference falls to second order."""
    maps = []
    for cells in (32, 64, 128):
        replay = Replay(device, Recipe.parse(GRIDS.format(cells)), pictures(), budget=0)
        replay.seek(12)
        maps.append(replay.warp.read((64, 48)))
        replay.release()
    moved = np.abs(maps[2]).max()
    assert moved > 0.02
    coarse, fine = (np.abs(maps[2] - maps[number]).mean() for number in (0, 1))
    assert fine < 1 / 512
    assert fine < coarse / 2


def test_a_point_is_followed(device: Device):
    """Where a point has gone is where the map looks it up."""
    recipe = Recipe.parse(GRIDS.format(64))
    replay = Replay(device, recipe, pictures(), budget=0)
    replay.seek(12)
    points = np.multiply(((0.5, 0.5), (0.45, 0.55), (0.6, 0.62), (0.0, 1.0)), replay.grid.extent)
    places = whereabouts(replay.warp, points)
    assert (np.abs(places - points).sum(axis=-1)[:3] > 0.01).all()
    assert places[3] == pytest.approx(points[3], abs=1e-6), "a corner"
    assert places + replay.warp.at(places) == pytest.approx(points, abs=1e-6)
    replay.release()


def test_a_point_is_followed_in_the_window_of_the_smallest_brush(device: Device) -> None:
    """Cells as small all over the picture would be no texture."""
    stroke = Stroke(tool="push", radius=0.0002, detail=FINEST_DETAIL, samples=((0, 0.5, 0.5, 1), (3, 0.5003, 0.5, 1)))
    recipe = Recipe(stroke=(stroke,), fluid=FluidSettings(grid=32, viscosity=1.0, drag=12.0))
    replay = Replay(device, recipe, pictures(), budget=0)
    replay.seek(4)
    assert replay.window is not None
    points = np.multiply(((0.5003, 0.5), (0.1, 0.2)), replay.grid.extent)
    places = whereabouts(replay.warp, points)
    assert np.hypot(*(places[0] - points[0])) > 1e-5
    assert places + replay.warp.at(places) == pytest.approx(points, abs=1e-6)
    replay.release()


@pytest.mark.parametrize("radius", [0.08, 0.12])
def test_a_frozen_pixel_is_the_same_in_every_later_frame(device: Device, radius: float) -> None:
    """Frozen by hand while it flows, after it has moved: not a bit of its colours changes from the next frame on."""
    freeze = Stroke.model_validate(
        {"tool": "freeze", "samples": ((5, 0.5, 0.45, 1), (8, 0.55, 0.5, 1)), "radius": radius}
    )
    recipe = RECIPE.edited(stroke=(*RECIPE.stroke, freeze))
    replay, sampler = Replay(device, recipe, pictures(), budget=0), Sampler(device)
    source = replay.pictures.source.pixels
    before, frozen = source, np.zeros(source.shape[:2], bool)
    finer = replay.masks.canvas.nx // source.shape[1]
    kept = 0
    for _ in range(LAST):
        replay.advance()
        now = sampler.apply(replay.warp, source)
        np.testing.assert_array_equal(now[frozen], before[frozen])
        kept += np.count_nonzero((now != source).any(axis=-1) & frozen)
        if replay.masks.frozen.size == replay.masks.canvas.size:
            texels = replay.masks.frozen.get() >= 128
            frozen = texels.reshape(60, finer, 80, finer).all(axis=(1, 3))
        before = now
    assert kept > 1000, "what had moved before it was frozen"
    sampler.release()
    replay.release()


def test_a_window_has_the_viscosity_that_the_whole_picture_has_there(device: Device) -> None:
    text = 'version = 1\npicture = "a.png"\nduration = 1.0\n[fluid]\ngrid = 64\n'
    layers = '[[viscosity]]\nkind = "picture"\nrange = [1e-3, 1.0]\n[[viscosity]]\nkind = "path"\nscale = 2.0\n'
    recipe = Recipe.parse(text + layers + "points = [[0.3, 0.4], [0.6, 0.5]]\n")
    replay = Replay(device, recipe, pictures(), budget=0)
    whole = replay.grid.refined(3)
    window = Grid(60, 45, (60 / 192, 45 / 192), (48 / 192, 30 / 192), whole.picture)
    fluids = Fluid(device, whole), Fluid(device, window)
    for fluid in fluids:
        replay.masks.apply(fluid)
    wanted, found = (fluid.viscosity.get() for fluid in fluids)
    np.testing.assert_array_equal(found, wanted[30:75, 48:108])
    assert found.max() > 100 * found.min()
    for thing in (*fluids, replay):
        thing.release()


@pytest.mark.parametrize("seed", range(6))
def test_quick_long_pushes_of_water_do_not_fold(seed: int, device: Device) -> None:
    """Straight through the picture, half a radius a step at most, on pictures of any aspect: by the chain rule."""
    rng = np.random.default_rng(seed)
    width, height = rng.integers(600, 1200, 2).tolist()
    radius = float(rng.uniform(0.04, 0.1))
    start, end = rng.uniform(0.1, 0.3, 2), rng.uniform(0.7, 0.9, 2)
    steps = int(np.ceil(np.hypot(*(end - start)) / (0.45 * radius))) + 1
    places = zip(*(np.linspace(a, b, steps).tolist() for a, b in zip(start, end, strict=True)), strict=True)
    samples = tuple((tick, x, y, 1.0) for tick, (x, y) in enumerate(places))
    push = Stroke.model_validate({"tool": "push", "samples": samples, "radius": radius})
    water = "version = 3\nduration = 2.0\n[fluid]\ngrid = 96\nviscosity = 0.0065\ndrag = 0.0"
    pictures = Pictures(Picture(np.zeros((height, width, 3), np.uint8)))
    replay = Replay(device, Recipe.parse(water).edited(stroke=(push,)), pictures, budget=0)
    replay.seek(steps + 10)
    found = replay.warp.statistics()
    assert (found.folds, found.displacement_max > radius) == (0, True)
    replay.release()


def test_until_anything_is_done_time_alone_passes(device: Device):
    """A stroke an hour into a clip: no step is made for what comes before it, and no moment of that is kept."""
    bare, found = Recipe.parse("duration = 3600.1\n[fluid]\ngrid = 16\ndt = 0.04\n"), list[np.ndarray]()
    for first in (0, 90_000):
        samples = (first, 0.3, 0.3, 1.0), (first + 1, 0.5, 0.4, 1.0)
        stroke = Stroke.model_validate({"tool": "push", "samples": samples})
        replay = Replay(device, bare.edited(stroke=(stroke,)), pictures())
        replay.seek(first + 2)
        assert replay.steps == 2
        assert len(replay.checkpoints) <= 2
        assert replay.fluid.time == pytest.approx(replay.time)
        found.append(replay.warp.read())
        replay.release()
    assert found[0].any()
    np.testing.assert_array_equal(found[0], found[1])


def test_strokes_that_are_too_much_together_are_refused_in_a_sentence(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As hundreds of the strongest in one place are; here the fluid bears less, which takes no time to exceed."""
    monkeypatch.setattr(energy, "LARGEST_SPEED", 1e-3)
    stroke = Stroke(tool="push", strength=100.0, samples=((0, 0.2, 0.5, 1.0), (1, 0.6, 0.5, 1.0)))
    replay = Replay(device, Recipe.parse("[fluid]\ngrid = 16").edited(stroke=(stroke, stroke)), pictures())
    said = r"^At 0\S* s the forces and brushes of this step are too large; make their strength less"
    with pytest.raises(UserError, match=said):
        replay.seek(3)
    replay.release()


def test_a_long_stroke_is_searched_not_read_through_at_each_of_its_ticks() -> None:
    """Of half a million samples, a thousand times in a tick; but for what it has travelled, of a push."""
    stroke = Stroke(
        tool="twirl", samples=((0, 0.1, 0.2, 1.0), (2, 0.5, 0.2, 0.5), (2, 0.6, 0.2, 0.5), (9, 0.6, 0.9, 1.0))
    )
    looked: list[int] = []

    class Samples(tuple[Sample, ...]):
        def __iter__(self) -> Iterator[Sample]:
            looked.append(1)
            return super().__iter__()

    seen = stroke.model_copy(update={"samples": Samples(stroke.samples)})
    for tick in range(-1, 11):
        assert seen.at(tick) == stroke.at(tick)
    assert [len(seen.at(tick)) for tick in (0, 1, 2, 3, 9, 10)] == [1, 1, 2, 1, 1, 0]
    assert not looked


def test_restoring_on_a_picture_of_a_few_columns_needs_no_texture_that_is_too_high(device: Device) -> None:
    """Its cells are so many along its height that what is gathered would be."""
    pixels = np.random.default_rng(0).integers(0, 256, (3000, 8, 3), np.uint8)
    recipe = Recipe.parse("""
        version = 5
        [fluid]
        viscosity = 0.03
        [[stroke]]
        tool = "push"
        radius = 0.1
        samples = [[0, 0.5, 0.42, 1.0], [4, 0.5, 0.5, 1.0]]
        [[stroke]]
        tool = "twirl"
        radius = 0.05
        samples = [[5, 0.5, 0.45, 1.0], [45, 0.5, 0.45, 1.0]]
        [[stroke]]
        tool = "restore"
        radius = 0.05
        samples = [[46, 0.5, 0.45, 1.0], [50, 0.5, 0.45, 1.0]]
    """)
    replay = Replay(device, recipe, Pictures(Picture(pixels)), budget=0)
    replay.seek(46)
    before = np.abs(replay.warp.read()).mean()
    replay.seek(52)
    after = replay.warp.read()
    assert np.isfinite(after).all()
    assert np.abs(after).mean() < before
    replay.release()
