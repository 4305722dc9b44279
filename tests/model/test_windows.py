"""Which window a stroke's flow is solved in, and that it makes no difference there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from app.media.auxiliary import Pictures
from app.model.handles import RecipeHandle, RecipePin
from app.model.picture import Picture
from app.model.presets import HONEY, PUTTY, WATER, Feel
from app.model.recipe import FluidSettings, Recipe
from app.model.strokes import Act, Dab, Stroke
from app.model.windows import CELLS, FlowWindow, Led, detail_for, detail_for_led, with_detail
from app.work.replay import Replay
from properties.windows import EDITORS, check_handles_in_windows, compare_paths, painted, same
from solver.gl.device import Device
from solver.grid import Grid
from support.leading import arrangement

WHOLE = Grid.for_picture(6000, 4000, 256)


def stroke(radius: float = 0.01, tool: str = "push", detail: int = 1365) -> Stroke:
    return Stroke.model_validate({"tool": tool, "radius": radius, "detail": detail, "samples": ((0, 0.5, 0.5, 1.0),)})


def at(x0: float, y0: float, x1: float, y1: float) -> tuple[Dab, ...]:
    return (Dab(x0, y0, x1, y1, 1.0),)


@pytest.mark.parametrize("feel", [PUTTY, HONEY])
@pytest.mark.parametrize("radius", [0.0003, 0.001, 0.004, 0.01, 0.02, 0.031])
def test_a_small_brush_has_12_to_16_cells_a_radius(feel: Feel, radius: float):
    recipe = Recipe(fluid=FluidSettings(viscosity=feel.viscosity, drag=feel.drag))
    detail = detail_for(radius, recipe, recipe.fluid)
    assert 12 - 1e-2 <= detail * radius <= 16 + 1e-2


def test_what_acts_on_the_whole_picture_has_no_window():
    recipe = Recipe(fluid=FluidSettings(viscosity=HONEY.viscosity, drag=HONEY.drag))
    assert detail_for(0.08, recipe, recipe.fluid) == 0  # 20 cells of the grid already
    thin = FluidSettings(viscosity=1e-6)
    assert detail_for(0.01, recipe, thin) == 0  # flows on and on
    assert detail_for(0.01, recipe, FluidSettings(viscosity=WATER.viscosity)) > 0
    for other in ({"mode": "density"}, {"fluid": FluidSettings(solver="paper")}):
        assert detail_for(0.01, recipe.edited(**other), recipe.fluid) == 0


def test_a_window_stays_while_the_brush_has_room_and_is_dragged_along_by_whole_cells():
    window = FlowWindow.of([Act(stroke(), 0, at(0.5, 0.5, 0.5, 0.5))], None, WHOLE)
    assert window is not None
    grid = window.grid_in(WHOLE)
    assert grid.size == (CELLS, CELLS)
    x, y = grid.centres()
    assert abs(x.mean() - 0.5) < 2 * grid.h
    assert abs(y.mean() - 0.5 * 2 / 3) < 2 * grid.h
    assert FlowWindow.of([Act(stroke(), 0, at(0.5, 0.5, 0.51, 0.5))], window, WHOLE) == window
    ahead = FlowWindow.of([Act(stroke(), 0, at(0.49, 0.5, 0.5, 0.5))], None, WHOLE)
    assert ahead is not None
    # A radius of the brush, of 12 cells, to the right of where it has come.
    assert ahead.column - window.column == pytest.approx(12, abs=1)
    assert ahead.row == window.row
    moved, place = window, 0.5
    seen = set()
    while place < 0.99:
        moved = FlowWindow.of([Act(stroke(), 0, at(place, 0.5, place + 0.01, 0.5))], moved, WHOLE)
        assert moved is not None
        assert moved.row == window.row
        seen.add(moved.column)
        place += 0.01
        left, _, width, _ = (*moved.grid_in(WHOLE).origin, *moved.grid_in(WHOLE).extent)
        assert left <= place - 0.04
        assert place + 0.04 <= left + width or moved.grid_in(WHOLE).at_edge[1]
    assert 5 < len(seen) < 20
    # At the picture's edge the window ends with it.
    assert moved.grid_in(WHOLE).at_edge == (False, True, False, False)


def test_a_stroke_that_begins_has_as_fine_cells_as_it_asks_for_and_one_that_goes_on_keeps_its_window():
    fine, here = stroke(detail=1365), at(0.5, 0.5, 0.5, 0.5)
    coarse = FlowWindow.of([Act(stroke(detail=512), 0, here)], None, WHOLE)
    assert coarse is not None
    begun = FlowWindow.of([Act(fine, 0, here)], coarse, WHOLE)
    assert begun is not None
    assert (coarse.detail, begun.detail) == (512, 1365)
    assert FlowWindow.of([Act(fine, 1, here)], coarse, WHOLE) == coarse


def test_what_no_window_holds_has_a_coarser_one_or_the_whole_picture():
    wide = FlowWindow.of([Act(stroke(), 0, at(0.4, 0.5, 0.5, 0.5))], None, WHOLE)
    assert wide is not None
    assert 256 < wide.detail < 1365
    assert FlowWindow.of([Act(stroke(), 0, at(0.0, 0.5, 1.0, 0.5))], None, WHOLE) is None
    here = at(0.5, 0.5, 0.5, 0.5)
    assert FlowWindow.of([Act(stroke(), 0, here), Act(stroke(detail=0), 0, here)], None, WHOLE) is None
    # Its images would lie outside.
    assert FlowWindow.of([Act(stroke().model_copy(update={"symmetry": "radial"}), 0, here)], None, WHOLE) is None
    far = [Act(stroke(), 0, at(0.1, 0.5, 0.1, 0.5)), Act(stroke(), 0, at(0.9, 0.5, 0.9, 0.5))]
    assert FlowWindow.of(far, None, WHOLE) is None


@pytest.mark.parametrize("size", [(6000, 4000), (5000, 1), (8, 4000), (12, 12), (601, 599)])
@pytest.mark.parametrize("place", [(0.5, 0.5), (-9.0, 10.0), (1.0, 0.0), (0.001, 0.999)])
def test_a_window_lies_in_any_picture(size: tuple[int, int], place: tuple[float, float]):
    whole = Grid.for_picture(*size, 64)
    for detail in (1, 100, 1365, 65536):
        window = FlowWindow.of([Act(stroke(detail=detail), 0, at(*place, *place))], None, whole)
        if window is not None:
            window.grid_in(whole)  # which a grid beyond the picture refuses
            assert max(window.grid_in(whole).size) <= CELLS
            assert window.detail <= detail


# -- of handles -------------------------------------------------------------------------------------------------------


def led(*places: tuple[float, float], detail: int = 512, way: float = 0.0, begins: bool = False, **more: Any) -> Led:
    """A handle of radius .04 at places in longer sides, which moves so far to the right in a tick, or rests."""
    here, given = np.array(places), dict[str, Any](reach=0.04, push=0.04) | more
    there = here + np.array([way, 0.0])
    return Led(detail=detail, here=here, then=there, is_moving=way > 0, begins=begins, **given)


@pytest.mark.parametrize("feel", [PUTTY, HONEY, WATER])
@pytest.mark.parametrize("radius", [0.001, 0.01, 0.05, 0.09])
def test_a_handle_has_18_to_24_cells_a_radius(feel: Feel, radius: float):
    recipe = Recipe(fluid=FluidSettings(viscosity=feel.viscosity, drag=feel.drag, grid=96))
    detail = detail_for_led(radius, recipe, recipe.fluid)
    assert 18 - 1e-1 <= detail * radius <= 24 + 1e-1


def test_a_handle_that_needs_no_window_does_not_keep_others_from_theirs():
    recipe = Recipe(fluid=FluidSettings(viscosity=HONEY.viscosity, drag=HONEY.drag, grid=96))
    assert 0 < detail_for_led(0.4, recipe, recipe.fluid) <= 96
    # What flows on and on has cells as small as the whole picture may have.
    assert detail_for_led(0.01, recipe, FluidSettings(viscosity=1e-7, grid=96)) == CELLS
    for other in ({"mode": "density"}, {"fluid": FluidSettings(solver="paper")}):
        assert detail_for_led(0.01, recipe.edited(**other), recipe.fluid) == 0


def test_handles_that_move_have_room_and_what_is_at_rest_elsewhere_needs_none():
    far = led((0.05, 0.6))
    window = FlowWindow.of([], None, WHOLE, [led((0.7, 0.3), way=0.002), far])
    assert window is not None
    assert window.detail == 512
    (left, top), (width, height) = window.grid_in(WHOLE).origin, window.grid_in(WHOLE).extent
    assert left <= 0.7 - 3 * 0.04
    assert left + width >= 0.702 + 3 * 0.04
    assert top <= 0.3 - 3 * 0.04
    assert top + height >= 0.3 + 3 * 0.04
    # At rest, all stay in it; and where they hold against a stroke elsewhere, it has room for both.
    assert FlowWindow.of([], window, WHOLE, [led((0.7, 0.3)), far]) == window
    beside = FlowWindow.of([Act(stroke(0.02, detail=682), 0, at(0.1, 0.9, 0.1, 0.9))], window, WHOLE, [far])
    assert beside is not None
    assert beside.detail == 682
    grid = beside.grid_in(WHOLE)
    assert grid.origin[0] <= 0.05 - 0.04 or grid.at_edge[0]
    assert grid.origin[1] <= 0.6 - 0.04


def test_handles_too_far_apart_for_a_fine_window_have_a_coarser_one():
    near, far = led((0.1, 0.1), way=0.002), led((0.9, 0.6), way=0.002)
    window = FlowWindow.of([], None, Grid.for_picture(6000, 4000, 96), [near, far])
    assert window is not None
    assert 96 < window.detail <= CELLS
    assert window.grid_in(WHOLE).is_whole
    assert FlowWindow.of([], None, WHOLE, [near, far]) is None
    # Its own again as soon as the other has arrived; but one that goes on only takes what has room to spare.
    coarse = FlowWindow(384, 60, 0)
    back = FlowWindow.of([], coarse, WHOLE, [led((0.4, 0.3), way=0.002)])
    assert back is not None
    assert back.detail == 512
    wide = [led((0.4, 0.3), (0.52, 0.3), way=0.002)]  # 6 radii and 3, of 9.4
    assert FlowWindow.of([], coarse, WHOLE, wide) == coarse
    anew = FlowWindow.of([], coarse, WHOLE, [led((0.4, 0.3), (0.52, 0.3), way=0.002, begins=True)])
    assert anew is not None
    assert anew.detail == 512


def test_what_is_late_waits_for_fine_cells_until_others_have_arrived():
    late: dict[str, Any] = {"way": 0.002, "is_late": True}
    whole = Grid.for_picture(6000, 4000, 96)
    near, far = led((0.1, 0.1), **late), led((0.9, 0.6), **late)
    at_far = FlowWindow.of([], None, whole, [far])
    assert at_far is not None
    assert at_far.detail == 512
    # One that is led on has them first, and a stroke likewise; what lies beside it has room there.
    goes_on = led((0.9, 0.6), way=0.002)
    assert FlowWindow.of([], None, whole, [near, goes_on]) == at_far
    assert FlowWindow.of([], at_far, whole, [goes_on, near]) == at_far
    painted = Act(stroke(0.02, detail=682), 0, at(0.9, 0.9, 0.9, 0.9))
    assert FlowWindow.of([painted], at_far, whole, [near]) == FlowWindow.of([painted], at_far, whole)
    beside = FlowWindow.of([], None, whole, [led((0.8, 0.5), **late), goes_on])
    assert beside is not None
    assert beside.detail == 512
    # Then what lies in the window, and then the first of the others.
    assert FlowWindow.of([], at_far, whole, [near, far]) == at_far
    assert FlowWindow.of([], at_far, whole, [near, led((0.9, 0.6))]) == FlowWindow.of([], at_far, whole, [near])
    elsewhere = FlowWindow.of([], at_far, whole, [near, led((0.1, 0.6), **late), led((0.9, 0.6))])
    assert elsewhere == FlowWindow.of([], at_far, whole, [near])
    # Where all lie in a coarser one, it stays as it is.
    coarse = FlowWindow.of([], None, whole, [led((0.1, 0.1), way=0.002), led((0.9, 0.6), way=0.002)])
    assert coarse is not None
    assert FlowWindow.of([], coarse, whole, [near, far]) == coarse
    # One on the whole picture has all there, late or not.
    assert FlowWindow.of([], at_far, whole, [goes_on, led((0.1, 0.1), detail=0, **late)]) is None


def test_one_handle_on_the_whole_picture_has_all_there():
    here = led((0.5, 0.3), way=0.002)
    assert FlowWindow.of([], FlowWindow(512, 100, 30), WHOLE, [here, led((0.1, 0.1), detail=0)]) is None
    assert FlowWindow.of([Act(stroke(), 0, at(0.5, 0.5, 0.5, 0.5))], None, WHOLE, [led((0.1, 0.1), detail=0)]) is None


# -- replayed ---------------------------------------------------------------------------------------------------------

SIZE = 900, 600
FINE = 3000, 2000  # six texels a cell of a window and more


def replayed(device: Device, recipe: Recipe, budget: int = 0, size: tuple[int, int] = SIZE) -> Replay:
    return Replay(device, recipe, Pictures(Picture(np.zeros((size[1], size[0], 3), np.uint8))), budget)


def a_stroke(
    rng: np.random.Generator, first: int = 0, tool: str = "push", detail: int | None = None, count: int | None = None
) -> Stroke:
    """A winding stroke away from the picture's edges, in a window unless another detail is given.

    count: of its samples, one in a tick; 8 to 20 where nothing is said.
    """
    radius = float(rng.uniform(0.025, 0.045))
    count = count or int(rng.integers(8, 21))
    turns = np.cumsum(rng.normal(0, 0.3, count)) + rng.uniform(0, 6.28)
    way = radius * rng.uniform(0.1, 0.4) * np.stack([np.cos(turns), 1.5 * np.sin(turns)])
    x, y = rng.uniform(0.35, 0.65, (2, 1)) + np.cumsum(way, axis=1)
    samples = tuple((first + k, float(x[k]), float(y[k]), 1.0) for k in range(count))
    recipe = painted()
    fine = detail_for(radius, recipe, recipe.fluid) if detail is None else detail
    return Stroke.model_validate({"tool": tool, "radius": radius, "detail": fine, "samples": samples})


def length(stroke: Stroke) -> float:
    return stroke.travelled(stroke.last_tick + 1, (1.0, SIZE[1] / SIZE[0]))


def off_the_whole(device: Device, stroke: Stroke, feel: Feel) -> tuple[float, float]:
    """How far a stroke in a window is off the same on cells as small all over the picture, and how far that moves."""
    maps = []
    for cells in (64, stroke.detail):
        recipe = painted(stroke, feel=feel, cells=cells, ticks=stroke.last_tick + 12)
        replay = replayed(device, recipe)
        replay.seek(recipe.ticks)
        assert (replay.window is None) == (cells == stroke.detail)
        maps.append(replay.warp.read(SIZE).astype(np.float64))
        replay.release()
    return np.linalg.norm(maps[0] - maps[1], axis=-1).max(), np.linalg.norm(maps[1], axis=-1).max()


@pytest.mark.parametrize("feel", [PUTTY, HONEY], ids=["putty", "honey"])
def test_a_stroke_in_a_window_ends_as_on_the_whole_picture(device: Device, feel: Feel):
    """On cells of the same size everywhere, the map differs by no more than a hundredth of the stroke's way."""
    stroke = a_stroke(np.random.default_rng(5))
    off, moved = off_the_whole(device, stroke, feel)
    assert moved > 0.1 * length(stroke)
    assert off < 0.01 * length(stroke)


def test_a_push_along_an_edge_that_glides_drives_no_more_than_its_neighbourhood(device: Device):
    along = tuple((tick, 0.5 + 0.005 * tick, 0.02, 1.0) for tick in range(13))
    stroke = Stroke(tool="push", radius=0.04, detail=341, samples=along)
    off, moved = off_the_whole(device, stroke, HONEY)
    assert moved > 0.5 * length(stroke)
    assert off < 0.01 * length(stroke)


@pytest.mark.parametrize(("tool", "y"), [("twirl", 0.02), ("bloat", 0.5), ("pinch", 0.03)])
def test_what_stands_still_moves_no_more_than_its_neighbourhood(device: Device, tool: str, y: float):
    """A bloat away from the edges and on one, and a twirl there: within a hundredth of what it moves."""
    stroke = Stroke.model_validate(
        {"tool": tool, "radius": 0.04, "detail": 341, "samples": ((0, 0.5, y, 1.0), (11, 0.5, y, 1.0))}
    )
    off, moved = off_the_whole(device, stroke, HONEY)
    assert moved > 0.05 * stroke.radius
    assert off < 0.01 * moved


@pytest.mark.parametrize(
    ("feel", "way"),
    [(PUTTY, 2.5), (HONEY, 2.5), (HONEY, 10.0)],  # honey reaches farther
    ids=["putty", "honey", "honey, far"],
)
def test_nothing_moves_at_the_sides_of_a_window(device: Device, feel: Feel, way: float):
    """Below a twentieth of a pixel of a picture of 6000, all along them, however near the brush has come to them."""
    radius = 160 / 6000
    samples = ((0, 0.4, 0.5, 1.0), (int(5 * way), 0.4 + way * radius, 0.5, 1.0))
    stroke = Stroke(tool="push", radius=radius, detail=455, samples=samples)
    recipe = painted(stroke, feel=feel, ticks=stroke.last_tick + 24)
    replay = replayed(device, recipe)
    for tick in (5, 12, recipe.ticks):
        replay.seek(tick)
        grid = replay.fluid.grid
        assert not any(grid.at_edge)
        x, y = grid.centres()
        before = x[0] > 0.4  # behind, a window before has moved something
        rim = np.concatenate([np.stack([x[k, before], y[k, before]], axis=-1) for k in (0, -1)]
                             + [np.stack([x[:, -1], y[:, -1]], axis=-1)])  # fmt: skip
        assert np.abs(replay.warp.at(rim.astype(np.float32))).max() * 6000 < 0.05
    replay.release()


@pytest.mark.long
def test_a_replay_in_windows_gives_the_same_bytes_by_any_path(device: Device):
    """Strokes of several sizes and one on the whole picture: seeks, checkpoints, other strokes and snapshots."""
    rng = np.random.default_rng(5)
    strokes = [a_stroke(rng, first, tool, count=5) for first, tool in ((0, "push"), (8, "twirl"), (22, "bloat"))]
    long = Stroke(
        tool="push", radius=0.03, detail=strokes[0].detail, samples=((14, 0.2, 0.3, 1.0), (20, 0.8, 0.7, 1.0))
    )
    thick = a_stroke(rng, 27, "thicken", 0, count=5)  # from then on a tick takes several times as long
    whole = Stroke(tool="push", radius=0.15, samples=((29, 0.3, 0.5, 1.0), (32, 0.5, 0.5, 1.0)))
    recipe = painted(strokes[0], thick, strokes[1], long, strokes[2], whole, feel=HONEY, ticks=33)
    plain = replayed(device, recipe)
    wanted, windows = {}, set()
    for tick in range(recipe.ticks + 1):
        plain.seek(tick)
        windows.add(plain.window)
        if tick in (3, 9, 18, 21, 33):
            wanted[tick] = plain.snapshot()
    assert None in windows
    assert len(windows) > 5
    replay = replayed(device, recipe, 2**28)
    for tick in (33, 9, 21, 33):
        replay.seek(tick)
        same(replay.snapshot(), wanted[tick])
    # Undone and done again, with the playhead where it was.
    replay.use(recipe.edited(stroke=recipe.stroke[:2]))
    replay.use(recipe)
    same(replay.snapshot(), wanted[33])
    for start, end in ((18, 21), (3, 9)):
        other = replayed(device, recipe)
        other.resume(start, wanted[start])
        other.seek(end)
        same(other.snapshot(), wanted[end])
        other.release()
    # One that is of no window changes nothing.
    before = replay.snapshot()
    with pytest.raises(ValueError, match="window"):
        replay.resume(18, wanted[18] | {"settings/window": np.array([455, 10**6, 0])})
    same(replay.snapshot(), before)
    for item in (plain, replay):
        item.release()


@pytest.mark.parametrize("seed", range(3))
def test_any_strokes_in_windows_give_the_same_bytes_by_any_path(device: Device, seed: int):
    """Over the picture's edges and beyond, of any detail and a brush of any size, masks among them, on any shape."""
    rng = np.random.default_rng(seed)
    size = tuple(rng.choice([3, 40, 150, 400], 2).tolist())
    tools = ("push", "twirl", "bloat", "pinch", "curve", "freeze", "thicken")
    strokes, first = list[Stroke](), 0
    for _ in range(6):
        ticks, places = int(rng.integers(2, 8)), rng.uniform(-0.2, 1.2, (2, 2))
        samples = tuple((first + k * ticks, *place, 1.0) for k, place in enumerate(places.tolist()))
        fine, radius = int(10 ** rng.uniform(0, 4.8)), float(10 ** rng.uniform(-6, 0))
        given = {"tool": rng.choice(tools), "radius": radius, "detail": fine, "samples": samples}
        strokes.append(Stroke.model_validate(given | {"local": float(rng.random())}))
        first += int(rng.integers(1, 8))
    recipe = painted(*strokes, feel=HONEY, cells=24, ticks=first + 8)
    compare_paths(device, recipe, (size[0], size[1]), rng, lambda: {"stroke": recipe.stroke[: int(rng.integers(5))]})


EXTENT = 1.0, SIZE[1] / SIZE[0]


def with_handles(recipe: Recipe, *handles: RecipeHandle, pins: tuple[RecipePin, ...] = ()) -> Recipe:
    """A recipe with handles and pins, each of its own detail."""
    made, held = ([with_detail(one, recipe, EXTENT) for one in several] for several in (handles, pins))
    return recipe.edited(handle=tuple(made), pin=tuple(held))


def test_a_handle_in_a_window_arrives_where_on_the_whole_picture_it_does_not(device: Device):
    """A radius far on a coarse grid: within a pixel of 6000 in its window, some hundred short without."""
    far = RecipeHandle(at=(0.4, 0.48), to=(0.44, 0.52), radius=0.05, duration=0.7)
    pin = RecipePin(at=(0.4, 0.62), radius=0.05)
    left = []
    bare = painted(cells=96, ticks=45, dt=EDITORS)
    for recipe in (with_handles(bare, far, pins=(pin,)), bare.edited(handle=(far,), pin=(pin,))):
        replay = replayed(device, recipe, size=FINE)
        replay.seek(replay.recipe.ticks)
        assert (replay.window is None) == (not recipe.handle[0].detail)
        left.append(replay.handles.away * 6000)
        assert replay.warp.statistics().det_min > 0.2
        replay.release()
    assert left[0].max() < 1.0
    assert left[1].max() > 50.0


def test_handles_led_one_after_another_all_arrive_in_fine_windows(device: Device):
    """Each begins before the one before it, far from it, has arrived: none is led on cells that the others need."""
    fluid = FluidSettings(grid=48, dt=EDITORS, viscosity=HONEY.viscosity, drag=HONEY.drag)
    recipe, places = Recipe(fluid=fluid, duration=2.0), [(0.15, 0.2), (0.85, 0.8), (0.15, 0.8)]
    handles = [
        RecipeHandle(at=place, to=(place[0] + 0.012, place[1]), radius=0.02, start=0.3 * number, duration=0.28)
        for number, place in enumerate(places)
    ]
    recipe = recipe.edited(handle=tuple(with_detail(each, recipe, (1.0, 2 / 3)) for each in handles))
    replay, details = replayed(device, recipe, size=FINE), set[int]()
    while replay.tick < recipe.ticks:
        replay.advance()
        assert replay.window is not None
        details.add(replay.window.detail)
    assert details == {recipe.handle[0].detail}
    assert (replay.handles.away * 512).max() < 0.5
    replay.release()


def test_what_is_at_rest_outside_the_window_stays_there(device: Device):
    """A handle that has arrived, and pins, while a stroke and then another handle have the window elsewhere."""
    first = RecipeHandle(at=(0.2, 0.3), to=(0.22, 0.3), radius=0.04, duration=0.3)
    then = RecipeHandle(at=(0.8, 0.7), to=(0.8, 0.74), radius=0.04, start=0.9, duration=0.4)
    pins = RecipePin(at=(0.2, 0.5), radius=0.04), RecipePin(at=(0.8, 0.4), radius=0.04)
    push = Stroke(tool="push", radius=0.03, detail=455, samples=((40, 0.5, 0.3, 1.0), (50, 0.55, 0.3, 1.0)))
    recipe = with_handles(painted(push, cells=96, ticks=110), first, then, pins=pins)
    replay, windows, places = replayed(device, recipe, size=FINE), list[FlowWindow | None](), list[np.ndarray]()
    for tick in range(recipe.ticks):
        replay.advance()
        if replay.window not in windows:
            windows.append(replay.window)
        if tick in (38, recipe.ticks - 1):
            places.append(replay.handles.places)
    assert len(windows) >= 3
    assert None not in windows
    assert replay.handles.away.max() * 6000 < 1.0
    np.testing.assert_allclose(places[1][:3], places[0][:3], atol=1 / 6000)
    assert replay.handles.halts == [None] * 4
    replay.release()


@pytest.mark.parametrize("seed", [0, 2])
def test_handles_in_windows_give_the_same_bytes_by_any_path(device: Device, seed: int):
    """On two shapes; tests/nightly.py tries more."""
    check_handles_in_windows(device, seed)


@pytest.mark.parametrize(
    ("size", "count", "radius", "seed"),
    [
        ((3000, 2000), 1, 0.0917, 3),
        ((3000, 2000), 4, 0.05, 4),
        ((3000, 500), 4, 0.03, 0),
        ((500, 3000), 16, 0.033, 5),
        ((2000, 2000), 16, 0.05, 1),
    ],
)
def test_random_handles_arrive_in_a_window(device: Device, size: tuple[int, int], count: int, radius: float, seed: int):
    """An arrangement over five radii, at 96 cells: within a twentieth of a pixel of 512, at rest, no fold."""
    points, targets, pins = arrangement(seed, count)
    extent, side = np.array(size) / max(size), 5 * radius
    corner = np.random.default_rng(seed).uniform(0, 1, 2) * np.maximum(extent - side, 0)
    feel = [PUTTY, HONEY, WATER][seed % 3]
    recipe = painted(feel=feel, cells=96, ticks=68, dt=EDITORS)
    places = [
        [tuple(place) for place in ((corner + side * each) / extent).tolist()] for each in (points, targets, pins)
    ]
    handles = [RecipeHandle(at=at_, to=to, radius=radius, duration=1.5) for at_, to in zip(*places[:2], strict=True)]
    held = [RecipePin(at=at_, radius=radius) for at_ in places[2]]
    finely = (tuple(with_detail(one, recipe, tuple(extent.tolist())) for one in each) for each in (handles, held))
    replay = replayed(device, recipe.edited(**dict(zip(("handle", "pin"), finely, strict=True))), size=size)
    replay.seek(recipe.ticks - 8)
    before = replay.handles.places
    replay.seek(recipe.ticks)
    assert replay.window is not None
    assert replay.handles.away.max() * 512 < 0.05
    assert np.hypot(*(replay.handles.places - before).T).max() * 512 / (8 * EDITORS) < 0.1
    found = replay.warp.statistics()
    assert found.folds == 0
    assert found.det_min > 0.2
    replay.release()
