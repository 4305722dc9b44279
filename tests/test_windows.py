"""Which window a stroke's flow is solved in."""

from __future__ import annotations

import pytest

from app.presets import HONEY, PUTTY, WATER
from app.recipe import FluidSettings, Recipe
from app.strokes import Dab, Stroke
from app.windows import CELLS, Window, detail_for
from solver.grid import Grid

WHOLE = Grid.for_picture(6000, 4000, 256)


def stroke(radius: float = 0.01, tool: str = "push", detail: int = 1365) -> Stroke:
    return Stroke.model_validate({"tool": tool, "radius": radius, "detail": detail, "samples": ((0, 0.5, 0.5, 1.0),)})


def at(*points: float) -> tuple[Dab, ...]:
    return (Dab(*points, 1.0),)


@pytest.mark.parametrize("feel", [PUTTY, HONEY])
@pytest.mark.parametrize("radius", [0.0003, 0.001, 0.004, 0.01, 0.02, 0.031])
def test_a_small_brush_has_12_to_16_cells_a_radius(feel, radius: float):
    recipe = Recipe(fluid=FluidSettings(viscosity=feel.viscosity, drag=feel.drag))
    detail = detail_for(stroke(radius), recipe, recipe.fluid)
    assert 12 - 1e-2 <= detail * radius <= 16 + 1e-2


def test_what_acts_on_the_whole_picture_has_no_window():
    recipe = Recipe(fluid=FluidSettings(viscosity=HONEY.viscosity, drag=HONEY.drag))
    assert detail_for(stroke(0.08), recipe, recipe.fluid) == 0  # 20 cells of the grid already
    assert detail_for(stroke(0.01, "freeze"), recipe, recipe.fluid) == 0
    thin = FluidSettings(viscosity=1e-6)
    assert detail_for(stroke(0.01), recipe, thin) == 0  # flows on and on
    assert detail_for(stroke(0.01), recipe, FluidSettings(viscosity=WATER.viscosity)) > 0
    for other in ({"mode": "density"}, {"fluid": FluidSettings(solver="paper")}):
        assert detail_for(stroke(), recipe.edited(**other), recipe.fluid) == 0


def test_a_window_stays_while_the_brush_has_room_and_is_dragged_along_by_whole_cells():
    window = Window.of([(stroke(), at(0.5, 0.5, 0.5, 0.5))], 0, None, WHOLE)
    assert window is not None
    grid = window.grid_in(WHOLE)
    assert grid.size == (CELLS, CELLS)
    x, y = grid.centres()
    assert abs(x.mean() - 0.5) < 2 * grid.h
    assert abs(y.mean() - 0.5 * 2 / 3) < 2 * grid.h
    assert Window.of([(stroke(), at(0.5, 0.5, 0.51, 0.5))], 0, window, WHOLE) == window
    moved, place = window, 0.5
    seen = set()
    while place < 0.99:
        moved = Window.of([(stroke(), at(place, 0.5, place + 0.01, 0.5))], 0, moved, WHOLE)
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


def test_what_no_window_holds_has_a_coarser_one_or_the_whole_picture():
    wide = Window.of([(stroke(), at(0.4, 0.5, 0.5, 0.5))], 0, None, WHOLE)
    assert wide is not None
    assert 256 < wide.detail < 1365
    assert Window.of([(stroke(), at(0.0, 0.5, 1.0, 0.5))], 0, None, WHOLE) is None
    assert (
        Window.of([(stroke(), at(0.5, 0.5, 0.5, 0.5)), (stroke(detail=0), at(0.5, 0.5, 0.5, 0.5))], 0, None, WHOLE)
        is None
    )
    far = [(stroke(), at(0.1, 0.5, 0.1, 0.5)), (stroke(), at(0.9, 0.5, 0.9, 0.5))]
    assert Window.of(far, 0, None, WHOLE) is None


@pytest.mark.parametrize("size", [(6000, 4000), (5000, 1), (8, 4000), (12, 12), (601, 599)])
@pytest.mark.parametrize("place", [(0.5, 0.5), (-9.0, 10.0), (1.0, 0.0), (0.001, 0.999)])
def test_a_window_lies_in_any_picture(size: tuple[int, int], place: tuple[float, float]):
    whole = Grid.for_picture(*size, 64)
    for detail in (1, 100, 1365, 65536):
        window = Window.of([(stroke(detail=detail), at(*place, *place))], 0, None, whole)
        if window is not None:
            window.grid_in(whole)  # which a grid beyond the picture refuses
            assert max(window.grid_in(whole).size) <= CELLS
            assert window.detail <= detail
