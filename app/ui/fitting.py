"""Fitting from the window: the handles' values are searched in a process of its own, and become one edit."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from pathlib import Path

from app.errors import UserError
from app.media.landmarks import Pairs
from app.model.handles import heading
from app.model.recipe import Recipe
from app.ui.export_dialog import under_way
from app.ui.messages import Messages
from app.ui.viewport import Rect
from app.ui.widgets import Ui
from app.ui.workspace import Workspace
from app.work.export_process import FitProcess
from app.work.fit_job import pairs_in
from app.work.fitting import DURATION, EVALUATIONS, Fit
from app.work.handle_status import FIT
from app.work.session import Session

TOLD = 6  # notices in a message


class Fits:
    """The fit that is under way, if any: `fluidwarp fit` of the work's own handles, or of pairs in files.

    Attributes:
        evaluations: see `Fit`.
        process: that fits, while one does.
    """

    def __init__(self, workspace: Workspace, messages: Messages) -> None:
        self._workspace, self._messages = workspace, messages
        self.evaluations = EVALUATIONS
        self.process: FitProcess | None = None
        self._session: Session | None = None  # whose handles are fitted, while they are
        self._of: Recipe | None = None  # what it was then
        self._stopping = False

    @property
    def is_running(self) -> bool:
        return self.process is not None

    def start(self) -> None:
        """Begin to fit the handles of the work that is open, as it is at its end."""
        if self.is_running:
            return
        session = self._workspace.session
        if not session.recipe.can_fit:
            self._messages.say("There is nothing to fit yet: drag a point to where it should go, with Handle.")
            return
        self._begin(session.recipe)

    def start_with(self, files: Sequence[Path], masks: tuple[Path, Path] | None = None) -> None:
        """Begin to fit the pairs in files, or the outline of one mask to that of another, as `fluidwarp fit` does.

        There will be a handle for each pair beside what there is.

        Raises:
            UserError: if they cannot be read, are not two sets of points, or something is being fitted.
        """
        if self.is_running:
            raise UserError("A fit is under way: stop it, or wait for it, and then give the pairs or masks again.")
        session = self._workspace.session
        picture, recipe = session.project.picture, session.recipe
        if session is self._workspace.placeholder and not session.has_begun:
            raise UserError("There is nothing to fit yet: first open the picture that the pairs or masks are of.")
        pairs, notices = pairs_in(files, masks, (picture.width, picture.height))
        for notice in notices:
            self._messages.say(f"{notice}.")
        self._begin(recipe if session.has_begun else recipe.edited(duration=DURATION[0]), pairs)

    def _begin(self, recipe: Recipe, pairs: Pairs | None = None) -> None:
        session = self._workspace.session
        session.seek(session.end)
        self._session, self._of, self._stopping = session, session.recipe, False
        project = session.project
        self.process = FitProcess(
            Fit(
                recipe,
                project.picture,
                project.folder,
                pairs,
                self.evaluations,
                clip=project.clip,
                source=project.label,
            )
        )

    def finish(self) -> None:
        """Let it end with the best so far."""
        if self.process is not None and not self._stopping:
            self.process.finish()
            self._stopping = True

    def give_up(self) -> None:
        """Stop it; nothing comes of it."""
        if self.process is not None:
            self.process.stop()
        self._end()

    def _end(self) -> None:
        self.process = self._session = self._of = None

    def draw(self, ui: Ui, canvas: Rect) -> None:
        """How far it is and how near it comes, with a button to stop it."""
        if (process := self.process) is None:
            return
        process.poll()
        if not self._is_still_of_use():
            self.give_up()
            again = "Press Fit" if process.fit.pairs is None else "Give the pairs or masks again"
            self._messages.say(f"The fit was stopped, because the work was changed meanwhile. {again} to start again.")
        elif process.is_done:
            session = self._session
            self._end()
            self._take(process, session)
        else:
            state = "checking the best" if self._stopping else process.state or "getting ready"
            words, more = f"Fitting: {state}", "The best that was found so far is kept."
            button = "" if self._stopping else "Stop"
            if under_way(ui, "fitting", canvas, words, process.part, button, "escape", more):
                self.finish()

    def _is_still_of_use(self) -> bool:
        """The work goes on being simulated as it was when the fit began, if perhaps on another grid."""
        session, recipe = self._workspace.session, self._of
        if session is not self._session or recipe is None:
            return False
        now = session.recipe
        return now is recipe or (
            now.duration == recipe.duration and now.on_grid(recipe.fluid.grid).agrees_until(recipe) == inf
        )

    def _take(self, process: FitProcess, session: Session | None) -> None:
        """Make what has been found an edit, and play it."""
        made = process.outcome.recipe
        if process.error:
            self._messages.warn(process.error)
        elif made is None or session is None:
            self._messages.say("The fit was stopped before it had found anything. Nothing has changed.")
        else:
            fluid = session.recipe.fluid.model_copy(update={"viscosity": made.fluid.viscosity})
            session.edit(FIT, handle=made.handle, pin=made.pin, duration=made.duration, fluid=fluid)
            session.seek(session.end)
            verdict, stopped = process.outcome.verdict, process.outcome.stopped
            if process.outcome.is_met:
                self._messages.done(f"{'Stopped; the best so far is kept' if stopped else 'Fitted'}: {verdict}.")
                return
            as_well = (
                "Stopped; the best so far is kept, and not all arrive" if stopped else "Fitted as well as it could be"
            )
            words = [f"{heading(notice)}." for notice in process.outcome.notices[:TOLD]]
            rest = [f"{len(process.outcome.notices) - TOLD} more like these."] * (len(process.outcome.notices) > TOLD)
            self._messages.warn(
                " ".join([f"{as_well}: {verdict}.", *words, *rest]),
                lambda: self._workspace.session is session and session.document.recipe.handle == made.handle,
            )
