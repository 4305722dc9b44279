"""Opening and saving what is worked on.

One long class: whatever is opened goes the same way, from the question about unsaved work to what is shown.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from imgui_bundle import imgui, imgui_ctx

from app.errors import UserError
from app.media import project as projects
from app.media.clip import rate_of
from app.media.files import in_text
from app.media.landmarks import ENDINGS
from app.media.maps import MAP_ENDINGS, holds
from app.media.numbered import sequence_of
from app.media.opening import check_picture
from app.media.outlines import outline
from app.media.pictures import write_picture
from app.media.project import SUFFIX, Project
from app.media.source import CLIP_ENDINGS, PICTURE_ENDINGS
from app.model.mask_edits import MASKS, UNITS, MaskName, PictureMask, as_grey
from app.model.picture import Picture
from app.model.presets import DEFAULT
from app.model.recipe import FluidSettings, Recipe
from app.ui import clipboard
from app.ui.chooser import FileChooser
from app.ui.dialogs import Dialogs, PictureOrMap, Unsaved
from app.ui.editor_state import EditorState
from app.ui.loading import Loading
from app.ui.messages import Messages
from app.ui.preferences import Preferences
from app.ui.saving import SaveDialog
from app.ui.viewport import Rect
from app.ui.widgets import Ui
from app.ui.workspace import Workspace
from app.work.handle_status import FIT
from app.work.recovery import Found

OPENABLE = tuple(dict.fromkeys((*PICTURE_ENDINGS, *CLIP_ENDINGS, SUFFIX, ".toml", *MAP_ENDINGS, *ENDINGS)))
TICK = 1 / 30  # seconds
AT_ONCE = 0.15  # seconds that opening may take without a word about it


@dataclass
class Files:
    """Everything about files that the window does.

    Attributes:
        show: opens a project that has been read, with its picture as the canvas shows it and what it was restored from.
        fit: fits pairs in files, or two masks, to the picture that is open.
    """

    workspace: Workspace
    chooser: FileChooser
    dialogs: Dialogs
    messages: Messages
    preferences: Preferences
    show: Callable[[Project, np.ndarray | None, Found | None], None]
    fit: Callable[[Sequence[Path], tuple[Path, Path] | None], None]
    _loading: Loading | None = field(default=None, init=False)

    # -- opening ----------------------------------------------------------------------------------------------------

    def ask_open(self) -> None:
        self.chooser.ask_which("Open", self.preferences.open_from, OPENABLE, self.open)

    def ask_frames(self) -> None:
        def load(path: Path) -> None:
            self.open_work(sequence_of(path))

        self.chooser.ask_which("Open numbered files, by one of them", self.preferences.open_from, PICTURE_ENDINGS, load)

    def ask_apply(self) -> None:
        endings = (*PICTURE_ENDINGS, *CLIP_ENDINGS)
        self.chooser.ask_which("Apply this project to", self.preferences.open_from, endings, self.apply)

    def ask_map(self) -> None:
        self.chooser.ask_which("Start from a warp map", self.preferences.open_from, MAP_ENDINGS, self.start_from_map)

    def ask_outlines(self) -> None:
        """Ask for two masks, and fit the outline of the one to that of the other."""

        def ask_other(one: Path) -> None:
            picture = self.workspace.session.project.picture
            outline(one, (picture.width, picture.height), [])  # to refuse it here, where it can be chosen anew
            title = "Fit it to a mask of where it goes"
            self.chooser.ask_which(title, one.parent, PICTURE_ENDINGS, lambda other: self.fit((), (one, other)))

        title = "Choose a mask of what is moved"
        self.chooser.ask_which(title, self.preferences.open_from, PICTURE_ENDINGS, ask_other)

    def ask_mask(self, state: EditorState) -> None:
        def load(path: Path) -> None:
            self.load_mask(path, state.mask)
            state.show_mask()

        self.chooser.ask_which(
            f"Load a picture of {MASKS[state.mask]}", self.preferences.open_from, PICTURE_ENDINGS, load
        )

    def ask_save_mask(self, of: MaskName) -> None:
        path = self.preferences.open_from / f"{self.workspace.session.project.name}-{of}.png"
        self.chooser.ask_where("Save the mask", path, (".png",), lambda path: self.save_mask(path, of))

    def open(self, path: Path, *others: Path) -> None:
        """Open a picture, a recipe or a project, after asking about unsaved work; of a warp map, start from it.

        What may be a picture as well as a map is asked about. Pairs are fitted, of which there may be two files.
        """
        if path.suffix.lower() in ENDINGS:
            self.fit((path, *others), None)
            return
        match holds(path):
            case "map":
                self.start_from_map(path)
            case "either":
                asked = PictureOrMap(path.name, lambda: self.open_work(path), lambda: self.start_from_map(path))
                self.dialogs.show(asked)
            case "picture":
                self.open_work(path)

    def open_work(self, path: Path) -> None:
        """Open a picture, a recipe or a project; about unsaved work is asked once that has been read."""
        fluid = self._feel()
        self.read(path, lambda: load_any(path, fluid), leaves=True)

    def _feel(self) -> dict[str, Any]:
        """What the person has set of the fluid; a recipe with forces of its own has been set by nobody here."""
        session = self.workspace.session
        feel = {} if session.recipe.force else settings_of(session.recipe.fluid_at(session.tick))
        history = session.document.history
        for before, entry in reversed([*pairwise(history.entries[: history.index + 1])]):
            # What a fit has found is for the handles of this work.
            if entry.name == FIT and feel.get("viscosity") == entry.recipe.fluid.viscosity:
                feel["viscosity"] = before.recipe.fluid.viscosity
        return feel

    def paste(self) -> None:
        """Open the picture that is on the clipboard, as a picture that is opened anew."""
        clipboard.check()
        path, fluid = clipboard.new_name(), self._feel()

        def load() -> Project:
            clipboard.paste(path)
            return load_any(path, fluid)

        self.read(path, load, leaves=True)

    def apply(self, path: Path) -> None:
        """Do to another picture what has been done to this one."""
        recipe = self.workspace.session.recipe
        self.read(path, lambda: projects.from_picture(path, recipe))

    def restore(self, found: Found) -> None:
        """Go on with work that was not saved when fluidwarp ended."""

        def load() -> Project:
            project = found.load()
            check_picture(project.picture)
            return project

        self.read(found.file, load, found)

    def start_from_map(self, path: Path) -> None:
        """Let what is done to the picture begin with a warp map instead of the picture as it is; can be undone.

        Raises:
            UserError: if it is none, or does not fit the picture.
        """
        path = path.resolve()
        self.workspace.session.start_from_map(in_text(str(path)))
        self.preferences.folder = str(path.parent)
        self.messages.done(f"The picture now starts from {path.name}. Undo removes it.")

    def load_mask(self, path: Path, of: MaskName) -> None:
        """Let a picture's brightness be a mask; can be undone.

        Raises:
            UserError: if it cannot be read.
        """
        session, name = self.workspace.session, in_text(str(path.resolve()))
        session.pictures.forget(name)
        session.pictures.load(name)
        session.edit_masks(f"Load {MASKS[of]}", PictureMask(kind="picture", tick=0, of=of, picture=name))
        self.preferences.folder = str(path.parent)

    def save_mask(self, path: Path, of: MaskName) -> None:
        """Write a mask as a picture of 16 bits that `load_mask` reads back.

        Raises:
            UserError: if nothing is painted on it, the work needs the file that is there, or it cannot be written.
        """
        session = self.workspace.session
        words = session.replay.masks.words(of)
        if words is None:
            raise UserError("There is nothing on this mask to save.")
        projects.check_pictures_kept(session.document.recipe, session.project.folder, path)
        write_picture(path, Picture(as_grey(words, of)[..., None]))
        thinned = of == "thickness" and words.min() < UNITS[of][0]
        self.messages.done(f"Saved {path.name}." + (" What is thinned is not in it." if thinned else ""))

    def read(self, path: Path, load: Callable[[], Project], found: Found | None = None, leaves: bool = False) -> None:
        """Read a file in the background, and open it then; what was being read before is not wanted any more.

        `leaves`: the work that is open has not to do with it.
        """
        self.give_up_loading()
        recipe = None if leaves else self.workspace.session.document.recipe
        largest = self.workspace.session.device.limits.max_texture_size
        self._loading = Loading(path, load, largest, recipe, found)
        self._loading.is_done(AT_ONCE)
        self.poll()

    @property
    def is_loading(self) -> bool:
        """A file is being read."""
        return self._loading is not None

    def give_up_loading(self) -> None:
        """Open nothing; the thread ends by itself."""
        if self._loading is not None:
            self._leave(self._loading)
        self._loading = None

    def poll(self) -> None:
        """See whether a file has been read."""
        workspace, loading = self.workspace, self._loading
        if loading is None or not loading.is_done():
            return
        # Nobody's stroke is broken off by a file that has come at last, nor does a dialog about the work lose it.
        if workspace.session.is_painting or (self.dialogs.shown and workspace.session is not workspace.placeholder):
            return
        self._loading = None
        if loading.error:
            self._leave(loading)
            self._warn(loading, loading.error)
        elif workspace.is_dirty and workspace.session.document.recipe is not loading.recipe:
            self.unless_unsaved(f"open {loading.name}", lambda: self._show(loading), can_undo=True)
        else:
            self._show(loading)

    def _show(self, loading: Loading) -> None:
        assert loading.project is not None
        try:
            self.show(loading.project, loading.pixels, loading.found)
        except UserError as error:
            self._leave(loading)
            self._warn(loading, error.in_window)
            return
        self.preferences.opened(loading.path)
        session = self.workspace.session
        for notice in session.pictures.notices:
            if notice not in session.objections:  # which are told of any work
                self.messages.say(notice)
        if loading.found is None:
            return
        if loading.found.is_as_it_was(loading.project):
            self.messages.done(f"“{self.workspace.session.project.name}” is restored. It has not been saved yet.")
        else:
            name = loading.project.recipe.picture
            self.messages.warn(f"All strokes are restored, but {name} is not the picture that they were made on.")

    def _warn(self, loading: Loading, error: str) -> None:
        """Tell why it is not open: of what a person has chosen, until something else is."""
        session = self.workspace.session
        self.messages.warn(error, lambda: loading.found is not None or self.workspace.session is session)

    @staticmethod
    def _leave(loading: Loading) -> None:
        """What could not be restored, or was not wanted yet, is offered again."""
        if loading.found is not None:
            loading.found.leave()

    def draw(self, ui: Ui, canvas: Rect) -> None:
        """What is being read, with a button to give it up."""
        if self._loading is None:
            return
        session = self.workspace.session
        is_sample = session is self.workspace.placeholder and not session.has_begun
        middle, half = canvas.middle[0], ui.px(160)
        with ui.floating(
            "loading", middle, ui.free_below(middle - half, middle + half, canvas.y + ui.px(16)), (0.5, 0)
        ):
            with imgui_ctx.begin_group():
                ui.text(f"Opening {self._loading.name} ...", size=14)
                ui.dim("The picture below is a sample." if is_sample else "You can go on meanwhile.")
            imgui.same_line(0, ui.px(16))
            if ui.button("Cancel##loading", height=30):
                self.give_up_loading()

    # -- saving -----------------------------------------------------------------------------------------------------

    def save(self, then: Callable[[], None] | None = None) -> None:
        """Save where it was saved last; where that is nowhere, or not as it was left, ask.

        `then`: what is done once it is saved.
        """
        project = self.workspace.session.project
        path = project.path
        if path is None or project.is_overtaken:
            self.ask_save(then)
        elif self.save_as(path) and then is not None:
            then()

    def ask_save(self, then: Callable[[], None] | None = None) -> None:
        project = self.workspace.session.project
        path = project.path or self.preferences.open_from / f"{project.name}{SUFFIX}"
        self.dialogs.show(SaveDialog(project, path, self.preferences, self.chooser, self.write, then))

    def unless_unsaved(self, what: str, then: Callable[[], None], can_undo: bool = False) -> None:
        """Do something that leaves unsaved work, once the person has said what shall become of it.

        `can_undo`: Undo comes back to it.
        """
        self.workspace.session.release()
        if self.workspace.is_dirty:
            self.dialogs.ask(Unsaved(self.workspace, what, can_undo, self.save, then))
        else:
            then()

    def save_as(self, path: Path, embed: bool | None = None) -> bool:
        """Save the project as `write` does; True if it could be done."""
        try:
            self.write(path, embed)
        except UserError as error:
            self.messages.warn(error.in_window)
            return False
        return True

    def write(self, path: Path, embed: bool | None = None) -> None:
        """Save the project. What is still moving comes to rest first.

        `embed`: the picture is kept in it; None is as it was saved last, or else as the person likes.

        Raises:
            UserError: if it cannot be done.
        """
        session = self.workspace.session
        session.release()
        if session.coasting:
            session.settle(2.0)
            session.stop_recording()
        project = replace(session.project, recipe=session.document.recipe)
        if embed is None:
            embed = project.embedded if project.path is not None else self.preferences.embed
        session.saved(projects.save(project, path, embed))
        self.preferences.opened(path)
        self.messages.done(f"Saved {path.name}")


def load_any(path: Path, fluid: dict[str, Any] | None = None) -> Project:
    """The project behind a picture, a clip, a recipe or a project file.

    `fluid`: settings with which the work on a picture or clip begins.

    Raises:
        UserError: if it is none of them, or cannot be read.
    """
    if path.suffix.lower() == ".toml":
        project = projects.from_recipe(path)
    elif projects.is_project(path):
        project = projects.load(path)
    else:
        project = projects.from_picture(path, fresh_recipe(fluid))
        if project.clip is not None:
            recipe = fresh_recipe(fluid, tick_for(rate_of(project.clip, project.recipe.output.fps)))
            project = replace(project, recipe=recipe.edited(picture=project.recipe.picture))
    check_picture(project.picture, path.name)
    return project


def tick_for(rate: Fraction) -> float:
    """Seconds of a tick for a clip: a whole number of its frames, or the other way round, and nearest to `TICK`."""
    frames = TICK * float(rate)
    return float(round(frames) / rate if frames > 1 else 1 / (rate * round(1 / frames)))


def settings_of(fluid: FluidSettings) -> dict[str, Any]:
    """What the inspector sets of a fluid."""
    return {name: getattr(fluid, name) for name in ("viscosity", "drag", "walls")}


def fresh_recipe(settings: dict[str, Any] | None = None, dt: float = TICK) -> Recipe:
    """What a picture that is newly opened starts with: the default, and what of the fluid the person has set."""
    fluid = FluidSettings(dt=dt, viscosity=DEFAULT.viscosity, drag=DEFAULT.drag)
    fluid = fluid.model_copy(update=settings or {})
    return Recipe(duration=fluid.dt, fluid=fluid, edges="clamp")
