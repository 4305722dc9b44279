"""The forces of a recipe: their shapes, what they conserve, and that no grid changes them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from pydantic import TypeAdapter, ValidationError

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.model.forces import Force, build, pieces_of
from app.model.picture import Picture
from app.model.sampling import Window
from app.model.schema import frozen
from solver.grid import Grid
from support.arrays import assert_near
from support.pictures import OnePicture

WIDE = Grid(96, 64)


def force(**keys: Any) -> Any:
    return TypeAdapter(Force).validate_python(frozen(keys))


def source(width: int = 192, height: int = 128) -> Picture:
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / width)
    disc = np.hypot(x - 0.5, y - height / width / 2) < 0.15
    return Picture(np.where(disc, 220, 30).astype(np.uint8)[..., None])


@pytest.fixture
def pictures(tmp_path: Path) -> Pictures:
    return Pictures(source(), tmp_path)


def divergence(faces: np.ndarray, grid: Grid) -> np.ndarray:
    """With walls all round, in float64."""
    faces = np.pad(faces.astype(np.float64), ((0, 1), (0, 1), (0, 0)))
    u, v = faces[..., 0], faces[..., 1]
    return (u[:-1, 1:] - u[:-1, :-1] + v[1:, :-1] - v[:-1, :-1]) / grid.h


def at_centres(faces: np.ndarray) -> np.ndarray:
    faces = np.pad(faces, ((0, 1), (0, 1), (0, 0)))
    return 0.5 * np.stack([faces[:-1, :-1, 0] + faces[:-1, 1:, 0], faces[:-1, :-1, 1] + faces[1:, :-1, 1]], axis=-1)


EVERY: list[dict[str, Any]] = [
    {"kind": "point", "point": [0.4, 0.5], "direction": [1, 0.5], "radius": 0.15},
    {"kind": "point", "point": [0.4, 0.5], "direction": [1, 0.5], "falloff": "gaussian", "divergence_free": False},
    {"kind": "curve", "points": [[0.3, 0.3], [0.6, 0.4], [0.7, 0.7]], "radius": 0.08},
    {"kind": "curve", "points": [[0.3, 0.3], [0.6, 0.4], [0.7, 0.7]], "spline": True, "direction": "normal"},
    {"kind": "curve", "points": [[0.3, 0.3], [0.6, 0.4]], "falloff": "gaussian", "direction": [0, -1], "radius": 0.1},
    {"kind": "gradient", "segment": {"above": 0.5}, "blur": 0.08},
    {"kind": "gradient", "blur": 0.08, "within": {"box": [0.3, 0.3, 0.7, 0.6], "soft": 0.1}},
    {"kind": "vortex", "point": [0.5, 0.5], "radius": 0.2},
    {"kind": "vortex", "point": [0.5, 0.5], "radius": 0.2, "falloff": "gaussian"},
]


@pytest.mark.parametrize("keys", EVERY)
def test_faces_have_the_grids_shape_and_keep_off_the_walls(keys: dict[str, Any], pictures: Pictures) -> None:
    faces = force(**keys).faces(WIDE, pictures)
    assert faces.shape == (64, 96, 2)
    assert faces.dtype == np.float32
    assert np.isfinite(faces).all()
    assert np.abs(faces).max() > 0.03
    assert not faces[:, 0, 0].any()
    assert not faces[0, :, 1].any()


@pytest.mark.parametrize("keys", EVERY)
def test_no_grid_changes_a_force(keys: dict[str, Any], pictures: Pictures) -> None:
    one = force(**keys)
    reference = at_centres(one.faces(Grid(768, 512), pictures)).reshape(128, 4, 192, 4, 2).mean(axis=(1, 3))
    errors = []
    for cells in (96, 192, 384):
        grid = Grid.for_picture(3, 2, cells)
        field = at_centres(one.faces(grid, pictures))
        means = reference.reshape(64, 2, 96, 2, 2).mean(axis=(1, 3)) if cells == 96 else reference
        k = max(1, cells // 192)
        field = field.reshape(field.shape[0] // k, k, field.shape[1] // k, k, 2).mean(axis=(1, 3))
        errors.append(np.abs(field - means).mean() / np.abs(means).mean())
    assert errors[0] < 0.03
    assert errors[2] < 0.004


@pytest.mark.parametrize("keys", EVERY)
def test_strength_and_only_strength_scales(keys: dict[str, Any], pictures: Pictures) -> None:
    one, two = (force(**keys, strength=s).faces(WIDE, pictures) for s in (1.0, -2.5))
    assert_near(two, -2.5 * one, abs=1e-5)


@pytest.mark.parametrize("falloff", ["smooth", "gaussian"])
@pytest.mark.parametrize("grid", [Grid(128, 128), Grid(150, 70)])
def test_push_and_twirl_are_divergence_free(falloff: str, grid: Grid, pictures: Pictures) -> None:
    for keys in ({"kind": "point", "direction": [3, 4]}, {"kind": "vortex"}):
        faces = force(**keys, point=[0.5, 0.5], radius=0.08, falloff=falloff, strength=2).faces(grid, pictures)
        # Rounding to float32 alone gives 1e-7 of the speed on each face.
        assert np.abs(divergence(faces, grid)).max() < 1e-6 * np.abs(faces).max() / grid.h


@pytest.mark.parametrize("falloff", ["smooth", "gaussian"])
def test_a_push_has_its_strength_at_the_point(falloff: str, pictures: Pictures) -> None:
    grid = Grid(301, 201)
    for free in (True, False):
        push = force(
            kind="point", point=[0.5, 0.5], direction=[3, 4], strength=2, falloff=falloff, divergence_free=free
        )
        assert at_centres(push.faces(grid, pictures))[100, 150] == pytest.approx([1.2, 1.6], rel=2e-3)


@pytest.mark.parametrize("keys", EVERY[:5])
def test_a_local_force_is_a_motion_of_what_is_under_it(keys: dict[str, Any], pictures: Pictures) -> None:
    whole, half, none = (force(**{**keys, "local": part}) for part in (1.0, 0.5, 0.0))
    bare = force(**{**keys, **({"divergence_free": False} if keys["kind"] == "point" else {})}).faces(WIDE, pictures)
    assert whole.faces(WIDE, pictures) is None
    assert none.motion(WIDE, pictures) is None
    np.testing.assert_array_equal(whole.motion(WIDE, pictures), bare)
    np.testing.assert_allclose(2 * half.motion(WIDE, pictures), bare, atol=1e-30)
    np.testing.assert_allclose(2 * half.faces(WIDE, pictures), none.faces(WIDE, pictures), atol=1e-30)


def test_a_gaussian_push_is_the_known_formula(pictures: Pictures) -> None:
    grid = Grid(256, 256)
    push = np.array([0.6, -0.8])
    faces = force(kind="point", point=[0.5, 0.5], direction=push.tolist(), radius=0.2, falloff="gaussian").faces(
        grid, pictures
    )
    for axis, (x, y) in enumerate((grid.u_faces(), grid.v_faces())):
        x, y, s = x - 0.5, y - 0.5, 0.1
        g, along = np.exp(-(x**2 + y**2) / (2 * s * s)), push[0] * x + push[1] * y
        expected = g * (push[axis] * (1 - (x**2 + y**2) / s**2) + (x, y)[axis] * along / s**2)
        inside = (slice(2, -2), slice(2, -2))
        assert_near(faces[..., axis][inside], expected[inside], abs=2e-3)


@pytest.mark.parametrize("falloff", ["smooth", "gaussian"])
def test_a_vortex_turns_clockwise_at_its_strength(falloff: str, pictures: Pictures) -> None:
    grid = Grid(300, 200)
    faces = at_centres(force(kind="vortex", point=[0.5, 0.5], strength=3, falloff=falloff).faces(grid, pictures))
    x, y = grid.centres()
    x, y = x - 0.5, y - 1 / 3
    near = np.hypot(x, y) < 0.01
    assert faces[near][:, 0] == pytest.approx(-3 * y[near], abs=1e-3)
    assert faces[near][:, 1] == pytest.approx(3 * x[near], abs=1e-3)


def test_forces_are_isotropic_on_pictures_that_are_not_square(pictures: Pictures) -> None:
    across = force(kind="point", point=[0.5, 0.5], direction=[1, 0], radius=0.1).faces(Grid(180, 90), pictures)
    down = force(kind="point", point=[0.5, 0.5], direction=[0, 1], radius=0.1).faces(Grid(90, 180), pictures)
    assert_near(across[..., 0], down[..., 1].T, abs=1e-5)
    assert_near(across[..., 1], down[..., 0].T, abs=1e-5)


@pytest.mark.parametrize("falloff", ["smooth", "gaussian"])
@pytest.mark.parametrize(("direction", "expected"), [("tangent", (1, 0)), ("normal", (0, 1)), ([0.0, -3.0], (0, -1))])
def test_a_straight_curve_has_its_strength_on_it(
    direction: Any, expected: tuple[float, float], falloff: str, pictures: Pictures
) -> None:
    grid = Grid(201, 201)
    line = force(
        kind="curve", points=[[0.1, 0.5], [0.9, 0.5]], direction=direction, radius=0.1, falloff=falloff, strength=2
    )
    faces = at_centres(line.faces(grid, pictures))
    assert faces[100, 60:140] == pytest.approx(np.broadcast_to(np.multiply(2, expected), (80, 2)), abs=0.01)
    assert np.abs(faces[100, 20]).max() == pytest.approx(1, abs=0.1), "half the strength at the end"
    if falloff == "smooth":
        assert not faces[:78].any()


def test_a_spline_passes_through_its_points_and_a_corner_has_no_seam(pictures: Pictures) -> None:
    corner = np.array([[0.2, 0.2], [0.5, 0.8], [0.8, 0.2]])
    at, tangents, lengths = pieces_of(corner, True, 0.01)
    assert min(np.hypot(*(at - corner[1]).T)) < 0.01
    assert np.abs(np.diff(tangents, axis=0)).max() < 0.2
    assert lengths.max() < 0.015
    _, _, straight = pieces_of(corner, False, 0.01)
    assert straight.sum() == pytest.approx(2 * math.hypot(0.3, 0.6))
    faces = force(kind="curve", points=corner.tolist(), radius=0.1).faces(Grid(200, 200), pictures)
    assert np.abs(np.diff(faces, axis=0)).max() < 0.15


def test_a_spline_is_that_of_catmull_and_rom() -> None:
    """Of evenly spaced points of a parabola: in its inner pieces, the parabola itself."""
    x = np.arange(5.0)
    at, tangents, lengths = pieces_of(np.stack([x, x * x / 4], axis=-1), True, 0.05)
    inner = (at[:, 0] > 1) & (at[:, 0] < 3)
    assert inner.sum() > 50
    assert at[inner, 1] == pytest.approx(at[inner, 0] ** 2 / 4, abs=1e-3)
    assert tangents[inner, 1] / tangents[inner, 0] == pytest.approx(at[inner, 0] / 2, abs=1e-3)
    assert lengths.max() <= 0.05


def field_picture(path: Path, pixels: np.ndarray) -> None:
    import imagecodecs

    path.write_bytes(imagecodecs.png_encode(pixels))


@pytest.mark.parametrize(("dtype", "zero"), [(np.uint8, 128), (np.uint16, 32768)])
def test_a_field_is_read_from_a_picture(dtype: Any, zero: int, pictures: Pictures) -> None:
    pixels = np.full((128, 192, 3), zero, dtype)
    pixels[40:80, 60:120, :2] = [2 * zero - 1, 1]
    field_picture(pictures.folder / "field.png", pixels)
    up, down, plain = (
        at_centres(force(kind="field", picture="field.png", strength=3, **keys).faces(WIDE, pictures))
        for keys in ({"green": "up"}, {"green": "down"}, {})
    )
    assert np.array_equal(plain, down)
    assert down[30, 45] == pytest.approx([3, -3], rel=1e-4)
    assert up[30, 45] == pytest.approx([3, 3], rel=1e-4)
    assert not down[:18].any(), "the middle value is exactly zero"


def test_a_field_of_another_shape_is_fitted_and_says_so(pictures: Pictures) -> None:
    field_picture(pictures.folder / "field.png", np.full((20, 20, 3), 255, np.uint8))
    force(kind="field", picture="field.png").faces(WIDE, pictures)
    assert pictures.notices == ["field.png is 20 x 20 and the picture 192 x 128: stretched to fit it"]


def test_a_gradient_points_out_of_what_is_chosen(pictures: Pictures) -> None:
    for keys in ({"segment": {"above": 0.5}}, {}):
        outward = at_centres(force(kind="gradient", blur=0.06, **keys).faces(WIDE, pictures))
        x, y = WIDE.centres()
        radial = ((x - 0.5) * outward[..., 0] + (y - 1 / 3) * outward[..., 1]) / np.hypot(x - 0.5, y - 1 / 3)
        assert radial.min() > -1e-3
        assert radial.max() == pytest.approx(1.0 if keys else 190 / 255, rel=0.1), "1 across a full edge"
    inward = at_centres(force(kind="gradient", blur=0.06, direction="inward").faces(WIDE, pictures))
    assert_near(inward, -outward, abs=1e-6)


def test_a_gradient_that_swells_keeps_its_divergence(pictures: Pictures) -> None:
    keys = {"kind": "gradient", "segment": {"above": 0.5}, "blur": 0.06}
    swelling = force(**keys, swell=True)
    assert swelling.faces(WIDE, pictures) is None
    s = swelling.divergence(WIDE, pictures)
    assert_near(s, divergence(force(**keys).faces(WIDE, pictures), WIDE), abs=1e-4)
    assert s[32, 40] > 0
    assert abs(s.sum()) < 1e-3 * np.abs(s).sum()


@pytest.mark.parametrize("falloff", ["smooth", "gaussian"])
@pytest.mark.parametrize("room", ["ring", "everywhere"])
def test_a_source_has_no_net_and_its_strength_in_the_centre(falloff: str, room: str, pictures: Pictures) -> None:
    for cells in (128, 256, 512):
        grid = Grid.for_picture(3, 2, cells)
        make = {"point": [0.5, 0.5], "radius": 0.12, "falloff": falloff, "room": room, "strength": 2.0}
        s = force(kind="source", **make).divergence(grid, pictures)
        assert abs(s.sum(dtype=np.float64)) * grid.h**2 < 1e-6
        background = 0.0 if room == "ring" else -2 * math.pi * 0.12**2 * (0.25 if falloff == "smooth" else 0.5) * 1.5
        assert s.max() == pytest.approx(2 + background, rel=0.01)
        x, y = grid.centres()
        # Divergence theorem: within r0 the area grows by the flow strength * r0 / 2 * profile(r0) through the circle.
        inside = np.hypot(x - 0.5, y - 1 / 3) < 0.06
        profile = 0.75**3 if falloff == "smooth" else math.exp(-0.5)
        if room == "ring":
            assert s[inside].sum() * grid.h**2 == pytest.approx(2 * math.pi * 0.06**2 * profile, rel=400 / cells**1.5)
        assert_near(force(kind="sink", **make).divergence(grid, pictures), -s, rel=1e-6, abs=1e-12)
        assert force(kind="source", **make).faces(grid, pictures) is None


def test_building_a_recipes_forces(pictures: Pictures) -> None:
    made = build([force(**keys, name=f"number {n}") for n, keys in enumerate(EVERY)], WIDE, pictures, 1.0)
    assert [one.label for one in made][:2] == ['force[1] "number 0"', 'force[2] "number 1"']
    assert made[0].law.impulse(0, 0.1) == 1
    assert all(one.faces is not None and one.divergence is None for one in made)


def test_a_force_that_never_acts_is_told(pictures: Pictures) -> None:
    build([force(kind="vortex", point=[0.5, 0.5], at=5, name="late")], WIDE, pictures, 1.0)
    assert pictures.notices == ['force[1] "late" never acts: it starts at 5 s, and the simulation ends at 1 s']


@pytest.mark.parametrize(
    ("keys", "part"),
    [
        ({"kind": "curve", "points": [[0.5, 0.5]]}, "at least two points, not 1"),
        ({"kind": "curve", "points": [[0.5, 0.5], [0.5, 0.5]]}, "all points"),
        ({"kind": "curve", "points": [[0.5, 0.5], [0.6, math.nan]]}, "finite|less|greater"),
        ({"kind": "curve", "points": [[0.5, 0.5], [0.6, 0.6]], "direction": "up"}, "direction"),
        ({"kind": "curve", "points": [[0.5, 0.5], [0.6, 0.6]], "direction": [0, 0]}, "points nowhere"),
        ({"kind": "point", "point": [0.5, 0.5], "direction": [0, 0]}, "points nowhere"),
        ({"kind": "point", "point": [0.5, 0.5], "direction": [1, 0], "radius": 0}, "radius"),
        ({"kind": "point", "point": [0.5, 0.5], "direction": [1, 0], "strength": math.inf}, "strength"),
        ({"kind": "point", "point": [0.5, 0.5], "direction": [1, 0], "strength": 1e30}, "strength"),
        ({"kind": "point", "point": [0.5], "direction": [1, 0]}, "point"),
        ({"kind": "vortex"}, "point"),
        ({"kind": "vortex", "point": [0.5, 0.5], "during": [1, 0]}, "ends before"),
        ({"kind": "vortex", "point": [0.5, 0.5], "formula": "boo(t)"}, "boo"),
        ({"kind": "vortex", "point": [0.5, 0.5], "keys": [[0, 1], [0, 2]]}, "overlap"),
        ({"kind": "wind"}, "wind"),
        ({"kind": "gradient", "blur": 0}, "blur"),
        ({"kind": "gradient", "segment": {"above": 2}}, "above"),
        ({"kind": "source", "point": [0.5, 0.5], "room": "here"}, "room"),
        ({"kind": "field"}, "picture"),
    ],
)
def test_bad_forces_are_refused(keys: dict[str, Any], part: str) -> None:
    with pytest.raises(ValidationError, match=part):
        force(**keys)


@pytest.mark.parametrize(
    ("keys", "part"),
    [
        ({"kind": "gradient", "segment": {"below": 0.01}}, "segmentation is empty"),
        ({"kind": "gradient", "segment": {"above": 0.01}}, "no edge"),
        ({"kind": "field", "picture": "source"}, "picture of its own"),
        ({"kind": "field", "picture": "grey.png"}, "is grey"),
        ({"kind": "field", "picture": "missing.png"}, "missing.png"),
        ({"kind": "gradient", "picture": "grey.png"}, "same everywhere"),
        ({"kind": "vortex", "point": [0.5, 0.5], "formula": "1/t"}, "divides by zero at t = 0"),
    ],
)
def test_what_cannot_be_built_names_the_force(keys: dict[str, Any], part: str, pictures: Pictures) -> None:
    Image.fromarray(np.full((128, 192), 77, np.uint8)).save(pictures.folder / "grey.png")
    with pytest.raises(UserError, match=rf'force\[2\] "hat": .*{part}'):
        build([force(**EVERY[0]), force(**keys, name="hat")], WIDE, pictures, 1.0)


def test_a_field_of_floats_is_itself_and_acts_where_it_is_opaque() -> None:
    """Of straight colours, half covered by alpha, half of them is left."""
    light = np.broadcast_to(np.array([2.5, -0.75, 0], np.float32), (64, 96, 3))
    found = at_centres(force(kind="field", picture="f.exr", strength=2).faces(WIDE, OnePicture(light)))
    np.testing.assert_allclose(found[32, 48], [5, -1.5], rtol=1e-6)
    covered = np.dstack([light, np.full((64, 96), 0.5, np.float32)])
    found = at_centres(force(kind="field", picture="f.exr", strength=2).faces(WIDE, OnePicture(covered)))
    np.testing.assert_allclose(found[32, 48], [2.5, -0.75], rtol=1e-6)
    codes = np.broadcast_to(np.array([255, 1, 0, 51], np.uint8), (64, 96, 4))
    found = at_centres(force(kind="field", picture="f.png").faces(WIDE, OnePicture(codes)))
    np.testing.assert_allclose(found[32, 48], [0.2, -0.2], rtol=1e-6)
    with pytest.raises(ValueError, match="not finite"):
        force(kind="field", picture="f.exr").faces(WIDE, OnePicture(np.full_like(light, np.inf)))


@pytest.mark.parametrize("falloff", ["smooth", "gaussian"])
def test_a_curve_s_push_across_it_is_the_profile(falloff: str, pictures: Pictures) -> None:
    """Of the smooth one, integrated along the line: (1 - q^2)^3.5; the Gaussian also far out."""
    grid = Grid(160, 160)
    line = force(kind="curve", points=[[0.0, 0.5], [1.0, 0.5]], radius=0.1, falloff=falloff).faces(grid, pictures)
    q = (grid.u_faces()[1][:, 80] - 0.5) / 0.1
    wanted = np.maximum(1 - q**2, 0) ** 3.5 if falloff == "smooth" else np.exp(-2 * q**2)
    np.testing.assert_allclose(line[:, 80, 0], wanted, rtol=2e-2, atol=1e-8)


@pytest.mark.parametrize("falloff", ["smooth", "gaussian"])
@pytest.mark.parametrize("kind", ["point", "vortex", "source"])
def test_a_radius_next_to_nothing_is_no_overflow(kind: str, falloff: str, pictures: Pictures) -> None:
    keys = {"direction": [1, 0]} if kind == "point" else {}
    tiny = force(kind=kind, point=[0.503, 0.503], radius=1e-308, falloff=falloff, **keys)
    with np.errstate(over="raise", invalid="raise"):
        made = tiny.divergence(WIDE, pictures) if kind == "source" else tiny.faces(WIDE, pictures)
    assert np.isfinite(made).all()


def test_a_source_smaller_than_a_cell_still_makes_room(pictures: Pictures) -> None:
    tiny = force(kind="source", point=[0.503, 0.503], radius=0.001, room="everywhere").divergence(WIDE, pictures)
    assert tiny.max() > 0.85
    as_wide = force(kind="source", point=[0.503, 0.503], radius=2 * WIDE.h, room="everywhere")
    np.testing.assert_array_equal(tiny, as_wide.divergence(WIDE, pictures))


def test_a_ring_is_as_a_gradient_has_it(pictures: Pictures) -> None:
    """rate + r / 2 d rate / dr is the divergence of x rate / 2."""
    grid = Grid(400, 400)
    x, y = grid.centres()
    r = np.hypot(x - 0.5, y - 0.5) / 0.3
    for falloff, profile in (("smooth", np.maximum(1 - r**2, 0) ** 3), ("gaussian", np.exp(-2 * r**2))):
        rate = force(kind="source", point=[0.5, 0.5], radius=0.3, falloff=falloff).divergence(grid, pictures)
        half = profile / 2
        wanted = np.gradient((x - 0.5) * half, grid.h, axis=1) + np.gradient((y - 0.5) * half, grid.h, axis=0)
        np.testing.assert_allclose(rate[5:-5, 5:-5], (wanted - wanted.mean())[5:-5, 5:-5], atol=3e-3)


def test_a_gradient_s_strength_is_that_of_the_steepest_place_of_an_edge() -> None:
    halves = np.where(np.arange(320) < 160, 0, 255).astype(np.uint8)[None, :, None].repeat(320, axis=0)
    for blur in (0.05, 0.1):
        found = force(kind="gradient", blur=blur, strength=3, direction="inward").faces(
            Grid(320, 320), OnePicture(halves)
        )
        assert found[160, :, 0].max() == pytest.approx(3, rel=5e-3)
        assert found[160, 160, 0] == found[160, :, 0].max()
        assert np.abs(found[..., 1]).max() < 1e-4


def test_a_gradient_within_a_window_is_weighed_by_it() -> None:
    halves = np.where(np.arange(64) < 32, 0, 255).astype(np.uint8)[None, :, None].repeat(64, axis=0)
    grid, window = Grid(64, 64), {"box": [0.1, 0.2, 0.9, 0.8], "soft": 0.2}
    bare, within = (
        force(kind="gradient", blur=0.3, **keys).faces(grid, OnePicture(halves)) for keys in ({}, {"within": window})
    )
    weight = Window.model_validate(frozen(window)).weight(grid)
    at_faces = (weight[:, 1:] + weight[:, :-1]) / 2
    np.testing.assert_allclose(within[:, 1:, 0], bare[:, 1:, 0] * at_faces, atol=1e-6)
    upright = OnePicture(halves.transpose(1, 0, 2))
    bare, within = (force(kind="gradient", blur=0.3, **keys).faces(grid, upright) for keys in ({}, {"within": window}))
    at_faces = (weight[1:] + weight[:-1]) / 2
    np.testing.assert_allclose(within[1:, :, 1], bare[1:, :, 1] * at_faces, atol=1e-6)
