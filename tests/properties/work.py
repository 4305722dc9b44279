"""Random work by hypothesis: a session that is painted in, undone, saved and reopened; recipes of any numbers."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.media.project import Project, load, save
from app.model.recipe import Recipe
from app.model.tools import TOOL, TOOLS, BrushSettings, Press
from app.work.replay import Replay
from app.work.session import Session
from solver.gl.device import Device
from support.editing import pattern, small_project
from support.gl_objects import living

PLACES = st.tuples(st.floats(-0.2, 1.2), st.floats(-0.2, 1.2))
PAINTING = [tool.name for tool in TOOLS if tool.gesture is not None]
CALM: dict[str, Any] = {"deadline": None, "database": None, "suppress_health_check": list(HealthCheck)}


class Work(RuleBasedStateMachine):
    """A person's work without a window. After each act the fluid is at rest and the playhead at the end."""

    device: Device

    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.session: Session | None = None
        self.seen: dict[int, tuple[Recipe, bytes]] = {}  # by the number of the edit

    @initialize()
    def begin(self) -> None:
        project = small_project(Path(self.folder.name), grid=16)
        calm = project.recipe.fluid.model_copy(
            update={"drag": 20.0}
        )  # at rest within a second, or an act takes minutes
        self._open(replace(project, recipe=project.recipe.edited(fluid=calm)))

    def _open(self, project: Project) -> None:
        if self.session is not None:
            self.session.release_gpu()
        self.session, self.seen = Session(self.device, project), {}
        self._look()

    @property
    def work(self) -> Session:
        assert self.session is not None
        return self.session

    def _look(self) -> None:
        """What is seen at the end of the work is what has been seen of this edit before."""
        work = self.work
        work.settle()
        work.seek(work.end)
        work.settle()
        now = work.document.recipe, work.replay.warp.read().tobytes()
        assert self.seen.setdefault(work.document.history.entries[work.document.history.index].number, now) == now

    @rule(tool=st.sampled_from(PAINTING), ends=st.tuples(PLACES, PLACES), ticks=st.integers(1, 3), back=st.booleans(),
          radius=st.floats(0.25, 0.4), at=st.floats(0, 1))  # fmt: skip
    def paint(
        self, tool: str, ends: tuple[tuple[float, float], ...], ticks: int, back: bool, radius: float, at: float
    ) -> None:
        """Somewhere in time; what lies behind it is another edit's afterwards."""
        work, (start, end) = self.work, ends
        work.seek(round(at * work.end))
        work.settle()
        work.press(TOOL[tool], Press(BrushSettings(radius, 0.5), back, work.extent, work.dt), *start)
        for tick in range(1, ticks + 1):
            part = tick / ticks
            x, y = (a + part * (b - a) for a, b in zip(start, end, strict=True))
            work.move(x, y)
            work.advance(1)
        work.release()
        self._look()

    @rule(viscosity=st.sampled_from((1e-4, 1e-2, 1.0)))
    def change(self, viscosity: float) -> None:
        self.work.change("Viscosity", viscosity=viscosity)
        self._look()

    @rule(amount=st.floats(0, 1.5), edges=st.sampled_from(("transparent", "black", "clamp", "mirror", "wrap")))
    def edit(self, amount: float, edges: str) -> None:
        self.work.edit("Edit", amount=amount, edges=edges)
        self._look()

    @precondition(lambda self: self.work.document.history.can_undo)
    @rule()
    def undo(self) -> None:
        self.work.undo()
        self._look()

    @precondition(lambda self: self.work.document.history.can_redo)
    @rule()
    def redo(self) -> None:
        self.work.redo()
        self._look()

    @precondition(lambda self: self.work.document.history.can_undo)
    @rule(part=st.floats(0, 1))
    def go_to(self, part: float) -> None:
        self.work.go_to(round(part * (len(self.work.document.history.entries) - 1)))
        self._look()

    @rule(count=st.integers(1, 4))
    def undo_and_redo(self, count: int) -> None:
        """As often as there is something; each step is the edit before, or after."""
        history, here = self.work.document.history, self.work.document.history.index
        for step in (*[-1] * min(count, here), *[1] * min(count, here)):
            wanted = history.entries[history.index + step].number
            self.work.undo() if step < 0 else self.work.redo()
            assert self._number() == wanted
            self._look()
        assert history.index == here

    @rule(embedded=st.booleans())
    def save_and_reopen(self, embedded: bool) -> None:
        """What is opened is what was saved, and is played as it was painted."""
        path, (recipe, warp) = Path(self.folder.name) / "work.fluidwarp", self.seen[self._number()]
        saved = save(replace(self.work.project, recipe=recipe), path, embedded)
        found = load(path)
        assert found.recipe == saved.recipe == recipe.edited(picture=found.recipe.picture)  # beside it, or inside
        self._open(found)
        assert self.seen[self._number()] == (found.recipe, warp)

    def _number(self) -> int:
        return self.work.document.history.entries[self.work.document.history.index].number

    @invariant()
    def is_well(self) -> None:
        if self.session is not None:
            assert np.isfinite(self.work.replay.warp.read()).all()
            assert np.isfinite(self.work.replay.fluid.velocity_at_centres()).all()
            assert self.device.ctx.error == "GL_NO_ERROR"

    def teardown(self) -> None:
        if self.session is not None:
            self.session.release_gpu()
        self.folder.cleanup()


def check_session(device: Device, number: int, examples: int = 4, acts: int = 25) -> dict[str, float]:
    """Random work in a session: each edit looks the same whenever it is come to, and nothing is left on the GPU."""

    def objects() -> int:
        return sum(living(device, "Texture", "Framebuffer", "Buffer", "Query", "VertexArray").values())

    machine = type("Work", (Work,), {"device": device})
    how = settings(max_examples=examples, stateful_step_count=acts, **CALM)
    counts = []
    for _ in range(2):  # what is made once, and kept, is there after the first time
        run_state_machine_as_test(seed(number)(machine), settings=how)  # type: ignore[arg-type]
        counts.append(objects())
    assert counts[0] == counts[1], f"{counts[1] - counts[0]} objects of OpenGL are left"
    return {"objects": counts[1]}


MEANT = st.floats(0.001, 1)  # a number that nearly every key takes
ANY = st.one_of(MEANT, MEANT, MEANT, st.floats(-1e3, 1e3), st.sampled_from((0.0, 1e-9, 1.0, 1e30, float("nan"), -1.0)))
SAMPLES = st.lists(
    st.tuples(st.integers(0, 4), st.floats(-1, 2) | ANY, st.floats(-1, 2), st.floats(0, 1) | ANY),
    min_size=1,
    max_size=5,
).map(lambda samples: [list(sample) for sample in sorted(samples, key=lambda sample: sample[0])])
PATHS = st.fixed_dictionaries(
    {"tool": st.sampled_from((*PAINTING, "pinch", "thin", "thaw", "none")), "samples": SAMPLES},
    optional={"radius": ANY, "hardness": ANY, "strength": ANY, "local": ANY, "reverse": st.booleans(),
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
