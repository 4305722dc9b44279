"""Recipes of any numbers, by hypothesis."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.model.recipe import Recipe
from app.model.tools import TOOLS
from app.work.replay import Replay
from solver.gl.device import Device
from support.editing import pattern

PLACES = st.tuples(st.floats(-0.2, 1.2), st.floats(-0.2, 1.2))
PAINTING = [tool.name for tool in TOOLS if tool.gesture is not None]
CALM: dict[str, Any] = {"deadline": None, "database": None, "suppress_health_check": list(HealthCheck)}


MEANT = st.floats(0.001, 1)  # a number that nearly every key takes
ANY = st.one_of(MEANT, MEANT, MEANT, st.floats(-1e3, 1e3), st.sampled_from((0.0, 1e-9, 1.0, 1e30, float("nan"), -1.0)))
SAMPLES = st.lists(
    st.tuples(st.integers(0, 4), st.floats(-1, 2) | ANY, st.floats(-1, 2), st.floats(0, 1) | ANY),
    min_size=1,
    max_size=5,
).map(lambda samples: [list(sample) for sample in sorted(samples, key=lambda sample: sample[0])])
PATHS = st.fixed_dictionaries(
    {"tool": st.sampled_from((*PAINTING, "pinch", "thin", "thaw", "none")), "samples": SAMPLES},
    optional={"radius": ANY, "hardness": ANY, "strength": ANY, "hold": ANY, "local": ANY, "reverse": st.booleans(),
              "symmetry": st.sampled_from(("none", "both", "radial")), "sectors": st.integers(-1, 20),
              "detail": st.sampled_from((0, 64, 128, -1))},
)  # fmt: skip
LED = st.fixed_dictionaries(
    {
        "at": st.tuples(st.floats(-0.2, 1.2), st.floats(0, 1)).map(list),
        "to": st.tuples(PLACES).map(lambda at: list(at[0])),
    },
    optional={"radius": ANY, "stiffness": ANY, "rotate": ANY, "scale": ANY, "start": ANY, "end": ANY, "local": ANY},
)
FORCES = st.fixed_dictionaries(
    {"kind": st.just("vortex"), "point": PLACES.map(list), "strength": ANY},
    optional={"radius": ANY, "at": ANY, "during": st.lists(ANY, max_size=3)},
)
RECIPES = st.fixed_dictionaries(
    {"duration": st.floats(0.01, 0.08), "fluid": st.fixed_dictionaries(
        {"grid": st.sampled_from((8, 9, 16)), "dt": st.sampled_from((1 / 60, 1e-6, 10.0, 0.02))},
        optional={"viscosity": ANY, "drag": ANY, "walls": st.sampled_from(("free-slip", "no-slip"))},
    )},
    optional={"amount": ANY, "stroke": st.lists(PATHS, max_size=3), "handle": st.lists(LED, max_size=2),
              "force": st.lists(FORCES, max_size=2)},
)  # fmt: skip


def check_recipes(device: Device, number: int, examples: int = 200) -> dict[str, float]:
    """A recipe of any numbers is refused in a sentence, or comes back from its text and moves nothing to infinity."""
    counts = {"played": 0.0, "refused": 0.0}
    source = pattern(24, 18)

    @seed(number)
    @settings(max_examples=examples, **CALM)
    @given(RECIPES)
    def play(data: dict[str, Any]) -> None:
        import tomlkit

        recipe = said = None
        try:
            recipe = Recipe.parse(tomlkit.dumps(data))
        except UserError as error:
            said = str(error)
        if recipe is None:
            counts["refused"] += 1
            assert said
            assert len(said.splitlines()) <= 2
            return
        assert Recipe.parse(recipe.text()) == recipe
        counts["played"] += 1
        replay = Replay(device, recipe, Pictures(source, Path()))
        try:
            for _ in range(min(recipe.ticks, 4)):
                with suppress(UserError):
                    replay.advance()
            assert np.isfinite(replay.warp.read()).all()
            assert np.isfinite(replay.fluid.velocity_at_centres()).all()
            assert device.ctx.error == "GL_NO_ERROR"
        finally:
            replay.release()

    play()
    assert counts["played"] > 0
    return counts
