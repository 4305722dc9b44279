"""Amount: as much of a warp as a recipe says, without folding what is not folded."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.media.pictures import read_picture, write_picture
from app.model.picture import Picture
from app.model.recipe import FluidSettings, Recipe
from app.model.schema import frozen
from app.model.strokes import Stroke
from app.work.replay import Replay
from solver.gl.device import Device
from solver.grid import Grid
from solver.resample.sampler import Sampler
from solver.warp.distortion import MapStatistics, distortion
from solver.warp.map import WarpMap
from solver.warp.scaled import ScaledMap
from support.commands import Run

PICTURE = Picture(np.random.default_rng(0).integers(0, 256, (80, 120, 3), np.uint8))
TWIRL = Stroke(tool="twirl", radius=0.25, samples=((0, 0.5, 0.5, 1.0), (30, 0.5, 0.5, 1.0)))
TURNED = Recipe(stroke=(TWIRL,), duration=1.2, fluid=FluidSettings(grid=96, dt=1 / 30))


def random_recipe(seed: int) -> Recipe:
    """Up to five strokes, each of a tool that moves the fluid."""
    rng, strokes, tick = np.random.default_rng(seed), list[Stroke](), 0
    for _ in range(rng.integers(1, 6)):
        tool, count = rng.choice(["push", "push", "twirl", "bloat", "pinch"]), int(rng.integers(3, 20))
        start, way = rng.uniform(0.1, 0.9, 2), rng.uniform(-0.25, 0.25, 2)
        path = np.clip(start + way * np.linspace(0, 1, count)[:, None], 0, 1).tolist()
        samples = tuple((tick + n, x, y, 1.0) for n, (x, y) in enumerate(path))
        strokes.append(Stroke(tool=tool, radius=rng.uniform(0.06, 0.2), samples=samples))
        tick += count
    fluid = FluidSettings(grid=64, dt=1 / 30, viscosity=10 ** rng.uniform(-4, -1.5))
    return Recipe(stroke=tuple(strokes), duration=(tick + 5) / 30, fluid=fluid)


def at_end(device: Device, recipe: Recipe) -> Replay:
    replay = Replay(device, recipe, Pictures(PICTURE), budget=0)
    replay.seek(recipe.ticks)
    return replay


def looked_at(device: Device, part: ScaledMap) -> MapStatistics:
    """How it distorts between the texels that it is drawn on."""
    nothing, field = device.field((8, 16), 4, "no submap, and its differences"), part.composed(exact=True)
    limits = (0.0, 0.0, *part.extent)
    parts = {"submap": nothing, "window": limits, "picture": part.extent, "accumulated": field, "limits": limits}
    found = distortion(device, field.size, {}, parts)
    nothing.release()
    return found


def least_det(device: Device, replay: Replay, amount: float) -> float:
    """The least det J; beyond 1, where a part comes after all of it, by the chain rule."""
    warp, part = replay.warp, ScaledMap(replay.warp, amount if amount <= 1 else amount - 1)
    if amount > 1:
        y, x = (np.mgrid[: warp.size[1], : warp.size[0]] + 0.5) / max(warp.size)
        at = (np.stack([x, y], axis=-1) + warp.read(warp.size)).reshape(-1, 2)
        across, down = ((part.at(at + step) - part.at(at - step)) / 2e-3 for step in 1e-3 * np.eye(2))
        dets = (1 + across[:, 0]) * (1 + down[:, 1]) - across[:, 1] * down[:, 0]
        return min(float(dets.min()), warp.statistics().det_min)
    found = looked_at(device, part)
    part.release()
    return found.det_min


@pytest.mark.parametrize("seed", [2, 5, 9, 10, 11, 12, 13])
def test_what_is_not_folded_is_folded_at_no_amount(device: Device, seed: int) -> None:
    replay = at_end(device, random_recipe(seed))
    assert least_det(device, replay, 1.0) > 0, "choose another seed"
    for amount in (0.1, 0.25, 0.4, 0.5, 0.6, 0.75, 0.9, 0.98, 1.2, 1.5):
        assert least_det(device, replay, amount) > 0, amount
    replay.release()


def test_along_what_is_frozen_a_part_tears_no_more_than_all_of_it(device: Device) -> None:
    """A quick push past a frozen square, which used up many factors, too coarse for what is beside it."""
    square = {"kind": "fill", "tick": 0, "of": "frozen", "amount": 1.0, "window": {"box": (0.3, 0.26, 0.51, 0.62)}}
    path = zip(np.linspace(0.38, 0.62, 14).tolist(), np.linspace(0.77, 0.39, 14).tolist(), strict=True)
    push = {
        "tool": "push",
        "radius": 0.15,
        "hardness": 0.0,
        "samples": [(n, x, y, 1.0) for n, (x, y) in enumerate(path)],
    }
    told = {"version": 4, "duration": 1.0, "fluid": {"grid": 128, "viscosity": 0.03, "drag": 2.0}}
    recipe = Recipe.model_validate(frozen({**told, "mask": [square], "stroke": [push]}))
    replay = Replay(device, recipe, Pictures(Picture(np.zeros((400, 600, 3), np.uint8))), budget=0)
    replay.seek(recipe.ticks)
    scaled = ScaledMap(replay.warp)
    folds = looked_at(device, scaled).folds
    for scaled.amount in (0.3, 0.6, 0.95):
        assert looked_at(device, scaled).folds <= folds, scaled.amount
    scaled.release()
    replay.release()


def test_half_of_a_half_turn_folds_only_if_it_is_scaled_in_one(device: Device) -> None:
    replay = at_end(device, TURNED)
    y, x = (np.mgrid[:80, :120] + 0.5) / 120
    half = np.stack([x, y], axis=-1) + 0.5 * replay.warp.read((120, 80))
    across, down = (np.gradient(half, 1 / 120, axis=axis) for axis in (1, 0))
    assert (across[..., 0] * down[..., 1] - across[..., 1] * down[..., 0]).min() < 0
    assert not replay.warp.factors.is_one
    assert least_det(device, replay, 0.5) > 0.1
    replay.release()


def test_none_of_it_and_all_of_it_are_exact_and_what_is_between_is_even(device: Device) -> None:
    replay = at_end(device, TURNED)
    scaled, maps = ScaledMap(replay.warp), list[np.ndarray]()
    for amount in np.linspace(0, 1.5, 31):
        scaled.amount = round(float(amount), 4)
        maps.append(scaled.read((120, 80)))
    assert not maps[0].any()
    assert np.array_equal(maps[20], replay.warp.read((120, 80)))
    steps = [np.abs(later - earlier).max() for earlier, later in pairwise(maps)]
    assert max(steps) < 2 * np.mean(steps)
    scaled.release()
    replay.release()


@pytest.mark.parametrize("amount", [0.5, 1.0, 1.5])
def test_a_part_is_drawn_only_where_it_is_asked_for(device: Device, amount: float) -> None:
    """Each texel of it is what it is in the whole."""
    warp, bands, step = WarpMap(device, Grid(12, 8), (60, 40)), [(0, 3, 60, 5), (10, 20, 7, 9)], (1 / 60, 1 / 40)
    y, x = (np.mgrid[:40, :60] + 0.5) / 60
    warp.set(0.1 * np.stack([np.sin(9 * y + x), np.cos(7 * x)], axis=-1))
    scaled, asked = ScaledMap(warp, amount), np.zeros((40, 60), bool)
    whole, part = (device.field((60, 40), 2, name) for name in ("whole", "part"))
    scaled.draw(whole, (0, 0), step)
    part.clear(7.0, 7.0)
    scaled.draw(part, (0, 0), step, regions=bands)
    for left, top, width, height in bands:
        asked[top : top + height, left : left + width] = True
    assert np.array_equal(part.get()[asked], whole.get()[asked])
    assert (part.get()[~asked] == 7).all()
    for made in (whole, part, scaled, warp):
        made.release()


def test_it_is_the_same_whichever_way_a_tick_is_reached(device: Device) -> None:
    recipe = TURNED.edited(amount=0.5)
    replay = at_end(device, recipe)
    there, kept = replay.seen.read(), replay.snapshot()
    replay.seek(5)
    assert not np.array_equal(replay.seen.read(), there)
    replay.resume(recipe.ticks, kept)
    assert np.array_equal(replay.seen.read(), there)
    replay.release()


def test_what_is_seen_is_as_much_as_the_recipe_says(device: Device) -> None:
    replay = at_end(device, TURNED)
    for amount in (0.0, 0.5, 1.0, 1.01, 1.5):
        replay.use(TURNED.edited(amount=amount))
        part = ScaledMap(replay.warp, amount)
        assert np.array_equal(replay.seen.read(), part.read()), amount
        assert np.array_equal(replay.seen.read(), replay.warp.read()) == (amount == 1), amount
        part.release()
    replay.release()


def test_the_command_line_takes_an_amount(fluidwarp: Run, tmp_path: Path) -> None:
    write_picture(tmp_path / "picture.png", PICTURE)
    whole = TURNED.on_grid(48).edited(picture="picture.png")
    (tmp_path / "whole.toml").write_text(whole.text())
    (tmp_path / "part.toml").write_text(whole.edited(amount=0.4).text())
    fluidwarp(tmp_path, "render", "whole.toml", "-o", "a.png", "--amount", "0.4")
    fluidwarp(tmp_path, "render", "part.toml", "-o", "b.png")
    fluidwarp(tmp_path, "render", "part.toml", "-o", "none.png", "--amount", "0")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert np.array_equal(read_picture(tmp_path / "none.png").pixels, PICTURE.pixels)
    assert not np.array_equal(read_picture(tmp_path / "a.png").pixels, PICTURE.pixels)
    refused = fluidwarp(tmp_path, "render", "whole.toml", "-o", "c.png", "--amount", "2")
    assert refused.returncode == 1
    assert "--amount must be at most 1.5, not 2" in refused.stderr


def test_an_amount_that_is_none_is_refused() -> None:
    with pytest.raises(UserError, match=r"'amount' must be at most 1.5, not 2"):
        Recipe.parse("amount = 2.0")
    with pytest.raises(UserError, match="'amount' scales a warp of coordinates"):
        Recipe.parse('amount = 0.5\nmode = "density"')


def test_what_is_frozen_keeps_every_bit_at_every_amount(device: Device) -> None:
    freeze = Stroke(tool="freeze", radius=0.12, hardness=1.0, samples=((0, 0.5, 0.35, 1.0), (1, 0.5, 0.35, 1.0)))
    twirl = TWIRL.model_copy(update={"samples": ((2, 0.5, 0.6, 1.0), (32, 0.5, 0.6, 1.0))})
    recipe = TURNED.edited(stroke=(freeze, twirl), fluid=FluidSettings(grid=48, dt=1 / 30))
    replay, sampler = at_end(device, recipe), Sampler(device)
    y, x = np.mgrid[:80, :120] + 0.5
    inside = np.hypot(x / 120 - 0.5, y / 120 - 0.35 * 2 / 3) < 0.1
    for amount in (0.3, 0.7, 1.5):
        replay.use(recipe.edited(amount=amount))
        found = sampler.apply(replay.seen, PICTURE.pixels)
        assert np.array_equal(found[inside], PICTURE.pixels[inside])
        assert not np.array_equal(found, PICTURE.pixels)
    sampler.release()
    replay.release()


def test_of_a_folded_warp_nothing_folds_at_no_amount(device: Device) -> None:
    replay = at_end(device, TURNED)
    y, x = np.mgrid[0:80, 0:120] / 120
    replay.warp.set(np.stack([0.2 * np.sin(20 * x), 0 * y], axis=-1).astype(np.float32))
    scaled = ScaledMap(replay.warp)
    assert scaled.statistics().folds > 0
    scaled.amount = 0.0
    assert (scaled.statistics().folds, scaled.statistics().displacement_max) == (0, 0.0)
    scaled.release()
    replay.release()


def test_no_part_of_what_folds_leads_out_of_the_picture(device: Device) -> None:
    """A local force leads a narrow picture out of itself in one tick, farther than its factors tell."""
    force = {"kind": "curve", "points": [[0.42078, 0.94832], [0.45332, 0.3035], [1.04109, 0.54226]]}
    force |= {"radius": 0.188, "falloff": "gaussian", "local": 1.0, "strength": 1.235}
    fluid = {"grid": 48, "viscosity": 0.3, "drag": 30.0, "walls": "no-slip"}
    told = {"force": [force], "duration": 0.08, "fluid": fluid}
    recipe = Recipe.model_validate(frozen({"version": 5, **told}))
    replay = Replay(device, recipe, Pictures(Picture(np.zeros((8, 300, 3), np.uint8))), budget=0)
    replay.seek(recipe.ticks)
    scaled = ScaledMap(replay.warp)
    places = (np.stack(np.meshgrid(np.arange(300), np.arange(8)), axis=-1) + 0.5) / 300
    for scaled.amount in (0.3, 0.55, 0.8, 1.3):
        led = places + scaled.read((300, 8))
        assert led.min() > -1e-6, scaled.amount
        assert (led < np.array(scaled.extent) + 1e-6).all(), scaled.amount
    scaled.release()
    replay.release()


def test_a_part_that_folds_beside_what_is_frozen_is_told(device: Device, fluidwarp: Run, tmp_path: Path) -> None:
    """A half turn far from a frozen corner: where anything is frozen all is scaled in one, and half of it folds."""
    corner = Stroke(tool="freeze", radius=0.03, hardness=1.0, samples=((0, 0.04, 0.06, 1.0), (1, 0.04, 0.06, 1.0)))
    recipe = TURNED.edited(stroke=(corner, TWIRL))
    replay = at_end(device, recipe)
    scaled = ScaledMap(replay.warp)
    assert scaled.statistics() == replay.warp.statistics()
    assert scaled.statistics().folds == 0
    for amount in (0.3, 0.5, 1.2, 1.5):
        scaled.amount = amount
        found, drawn = scaled.statistics(scaled.size), looked_at(device, scaled)
        assert found.folds == pytest.approx(drawn.folds, rel=0.02, abs=40), amount
        assert found.displacement_max == pytest.approx(drawn.displacement_max, rel=1e-3), amount
    scaled.release()
    replay.release()
    write_picture(tmp_path / "picture.png", PICTURE)
    (tmp_path / "part.toml").write_text(recipe.edited(picture="picture.png", amount=0.5).text())
    said = fluidwarp(tmp_path, "render", "part.toml", "-o", "a.png").stderr
    assert re.fullmatch(
        r"fluidwarp: the warp folds over itself in \d+ of \d+ places at an amount of 0.5, and in none at 1\n", said
    )
    assert not fluidwarp(tmp_path, "render", "part.toml", "-o", "b.png", "--amount", "1").stderr
