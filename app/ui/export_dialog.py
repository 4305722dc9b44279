"""Export from the window: asks what is wanted, and does it in a process of its own, so that the window stays usable.

Long, as the dialog holds a row for each setting; what can be chosen is in `export_choices.py`, the export itself in
`app/work/export.py`.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from fractions import Fraction
from math import floor
from pathlib import Path
from weakref import WeakKeyDictionary

import moderngl
from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.errors import UserError, printable
from app.media.clip import WHOLE, FrameRange, rate_of
from app.media.encoders import written_size
from app.media.formats import FORMATS
from app.media.leftovers import temporary_folder
from app.media.numbered import is_sequence, is_there
from app.media.pictures import read_picture
from app.media.project import check_pictures_kept
from app.model.edits import ending_at
from app.model.handles import heading
from app.model.timeline import NEARLY, Sentinel, Timeline, steps_of
from app.ui.canvas import shown_pixels
from app.ui.chooser import FileChooser
from app.ui.clipboard import Giving, check
from app.ui.dialogs import EXISTS, Dialog, Replaced, beside
from app.ui.export_choices import (
    ANIMATION,
    FILTERS,
    FINER,
    KINDS,
    MAP,
    PICTURE,
    PRESETS,
    PRINTED,
    RATED,
    Choices,
    Preset,
    holds_light,
)
from app.ui.messages import Messages
from app.ui.preferences import Preferences
from app.ui.theme import packed
from app.ui.units import SECONDS, Unit
from app.ui.viewport import Rect
from app.ui.widgets import Ui
from app.work.export_process import ExportProcess
from app.work.jobs import Job, MapOutput, Outputs, longer_side
from app.work.session import Session
from solver.gl.device import Device

PREVIEW = 640  # pixels along the longer side


class ExportDialog(Dialog):
    """What is to be written: picture, animation or warp map, size, rate, part.

    Args:
        session: what is exported.
        exports: does it.
        chooser: lets the person look for another place.
        preferences: where it was exported to last.

    Attributes:
        choices: what is chosen; the next export of the same work begins with it.
        presets: those that there are for it.
    """

    width, tallest = 500, 664

    def __init__(self, session: Session, exports: Exports, chooser: FileChooser, preferences: Preferences) -> None:
        super().__init__("Export")
        self.session = session
        self._exports = exports
        self._chooser = chooser
        self._preferences = preferences
        self.picture = replace(session.project.picture, note="")  # it was told when the picture was opened
        self.clip = session.project.clip
        last = exports.chosen.get(session)
        is_same = last is not None and last.extent == (self.picture.width, self.picture.height)
        self.choices = deepcopy(last) if last and is_same else Choices.of(session, preferences.export_as)
        # No clip is played backwards.
        self.presets = [preset for preset in PRESETS if not (preset.returns and self.clip)]
        # Beside lights that are many times as bright as white it shows, elsewhere hardly.
        is_sharp = session.recipe.output.filter == FILTERS[0][0]
        self._may_ring = self.picture.linear or not is_sharp or (self.clip is not None and self.clip.colours.is_high)
        self.start = 0.0
        self._end: float | None = None
        self.folder = preferences.export_to
        self._preview: ExportProcess | None = None
        self._image: moderngl.Texture | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._replaced = Replaced()
        self._named = self._proposed
        self.name = self._named if last is None or last.name is None else last.name

    @property
    def is_busy(self) -> bool:
        return self._preview is not None

    def release(self) -> None:
        if self._image is not None:
            self._image.release()
        if self._folder is not None:
            self._preview.stop(self._folder.cleanup) if self._preview is not None else self._folder.cleanup()
        self._image = self._folder = self._preview = None

    @property
    def animation(self) -> bool:
        return self.choices.kind == ANIMATION

    @property
    def use(self) -> str:
        """What the kind of file is good for, of this picture."""
        if self.choices.kind == PICTURE and self.picture.linear and not holds_light(self.choices.file_kind):
            return "What is brighter than white becomes white; EXR and TIFF keep it."
        return self.choices.file_kind.use

    @property
    def ending(self) -> str:
        return self.choices.how.ending

    def take(self, preset: Preset) -> None:
        """Choose all that a preset says; place and part stay."""
        choices = self.choices
        self._choose(preset.kind)
        choices.format[preset.kind] = preset.format
        choices.variant[preset.kind][preset.format] = preset.variant
        choices.size, choices.quality, choices.fps, choices.returns, choices.dpi = self._of(preset)
        choices.dissolve = 0.0

    def _of(self, preset: Preset) -> tuple[int, int, float, bool, float | None]:
        own = max(self.picture.width, self.picture.height)
        return min(own, preset.size or own), preset.quality, preset.fps, preset.returns, preset.dpi

    @property
    def preset(self) -> int:
        """The one that says what is chosen; -1 if none does."""
        choices = self.choices
        file = choices.format[choices.kind]
        chosen = choices.kind, file, choices.variant[choices.kind][file]
        now = choices.size, choices.quality, choices.fps, choices.returns, choices.dpi
        for number, preset in enumerate(self.presets):
            is_plain = not (self.animation and choices.dissolve)
            if is_plain and chosen == (preset.kind, preset.format, preset.variant) and now == self._of(preset):
                return number
        return -1

    @property
    def output(self) -> Path:
        return self.folder / (self.name + self.ending)

    def job(self) -> Job:
        """What the person has asked for."""
        choices, session = self.choices, self.session
        recipe = session.document.recipe
        if not self.animation:
            # The picture that is seen: the warp at the playhead.
            recipe = ending_at(recipe, session.target)
        grid = min(recipe.fluid.grid * FINER[choices.finer][1], 1024)
        own = max(self.picture.width, self.picture.height)
        output = recipe.output.model_copy(
            update={
                "size": None if choices.size == own else choices.size,
                "fps": choices.fps,
                "quality": choices.quality,
                "filter": FILTERS[choices.filter][0],
            }
        )
        part = recipe.time.model_copy(
            update={
                "start": self.start,
                "end": max(self.end, self.start),
                "ping_pong": choices.returns,
                "dissolve": 0.0 if choices.returns else self._dissolves,
            }
        )
        recipe = recipe.edited(
            output=output,
            time=part if self.animation and self.clip is None else recipe.time,
            fluid=recipe.fluid if grid == recipe.fluid.grid else recipe.fluid.model_copy(update={"grid": grid}),
        )
        if choices.kind == MAP:
            maps = MapOutput(self.output, "offsets" if choices.offsets else "st", choices.forward)
            return Job(recipe, self.picture, session.project.folder, Outputs(None, maps=maps), self.clip)
        how = choices.how
        outputs = Outputs(self.output, animated=how.animated, bits=how.bits, codec=how.codec, recorded=False)
        if self.animation:
            outputs = replace(outputs, part=self._frames)
        elif self._holds_dpi:
            outputs = replace(outputs, dpi=choices.dpi)
        clip, frame = (self.clip, None) if self.animation else (None, session.still)
        return Job(recipe, self.picture, session.project.folder, outputs, clip, frame)

    @property
    def _frames(self) -> FrameRange:
        """The frames of the clip between the two ends that are chosen."""
        if self.clip is None or (self.start <= 0 and self.end >= self._seconds):
            return WHOLE
        first, last = (floor(at * float(self._rate) + NEARLY) for at in (self.start, max(self.end, self.start)))
        return self.clip.number_at(first), self.clip.number_at(last)

    @property
    def _longest_dissolve(self) -> float:
        """Seconds: half of the animation, in whole frames; 0 if these are less than two."""
        recipe = self.session.document.recipe
        if recipe.time.hold_first or recipe.time.hold_last:
            return 0.0
        shown = recipe.time.model_copy(update={"start": self.start, "end": max(self.end, self.start)})
        frames = steps_of(Timeline.of(recipe), shown, self.choices.fps) // 2
        return frames / self.choices.fps if frames > 1 else 0.0

    @property
    def _dissolves(self) -> float:
        """Seconds: as asked for, but no less than two frames, and no more than there is."""
        choices = self.choices
        asked = 0.0 if choices.dissolve < 1 / choices.fps else max(choices.dissolve, 2 / choices.fps)
        return min(asked, self._longest_dissolve)

    @property
    def _seconds(self) -> float:
        """That there is something to see of."""
        return self.session.length * self.session.dt

    @property
    def end(self) -> float:
        """Where the animation ends, seconds: with the recording, which may go on meanwhile, unless chosen otherwise."""
        return self._seconds if self._end is None else self._end

    @end.setter
    def end(self, end: float) -> None:
        self._end = end

    @property
    def written(self) -> tuple[int, int]:
        """Width and height of what is written."""
        own = self.picture.width, self.picture.height
        size = longer_side(own, self.choices.size)
        return written_size(f"frames{self.ending}", size) if self.animation else size

    @property
    def _holds_dpi(self) -> bool:
        return self.choices.kind == PICTURE and "dpi" in FORMATS[self.ending].keeps

    @property
    def _rate(self) -> Fraction:
        """Frames a second of what is written."""
        return rate_of(self.clip, self.choices.fps)

    def body(self, ui: Ui) -> bool:
        with self.scrolled(ui, foot=6 + 32):
            self._ask(ui)
        imgui.dummy(ImVec2(0, ui.px(6)))
        if self.session.is_moving:  # beside the buttons, which stay where they are when it comes to rest
            imgui.align_text_to_frame_padding()
            ui.dim("Still moving: " + ("recorded until you export." if self.animation else "this moment is exported."))
            imgui.same_line()
        imgui.set_cursor_pos_x(imgui.get_window_width() - ui.px(24 + 96 + 8 + 96))
        if ui.button("Cancel", width=96):
            return False
        imgui.same_line()
        with ui.enabled(self._can_start):
            if ui.button("Export", primary=True, width=96) or (self.entered and self._can_start):
                return not (self._replaced.is_told and self.attempt(self._start))
        return True

    def _ask(self, ui: Ui) -> None:
        """A row for each setting."""
        choices = self.choices
        imgui.align_text_to_frame_padding()
        ui.dim("Preset")
        imgui.same_line(0, ui.px(12))
        names, uses = [preset.name for preset in self.presets], [preset.use for preset in self.presets]
        chosen = ui.segmented("preset", names, now := self.preset, -1, uses)
        if chosen != now:
            self.take(self.presets[chosen])
        self._choose(ui.segmented("kind", [label for label, _ in KINDS], choices.kind, -1))
        files, chosen = KINDS[choices.kind][1], choices.format[choices.kind]
        chosen = choices.format[choices.kind] = ui.segmented("format", [file.name for file in files], chosen, -1)
        if len(variants := choices.file_kind.variants) > 1:
            labels, now = [variant.label for variant in variants], choices.variant[choices.kind][chosen]
            choices.variant[choices.kind][chosen] = ui.segmented("variant", labels, now, -1)
        ui.wrapped(self.use, ui.palette.dim, 13)
        own = max(self.picture.width, self.picture.height)
        width, height = self.written
        unit, shown = Unit(" pixels", self.picture.width / own), f"{width} x {height} pixels"
        slid = ui.slider("size", "Size", choices.size, 16, max(own * 2, 64), unit, own, shown)
        choices.size = round(slid.value)
        if self.ending in RATED and not choices.how.animated:
            slid = ui.slider("quality", "Quality", choices.quality, 1, 100, default=90)
            choices.quality = round(slid.value)
        if self._holds_dpi:
            imgui.align_text_to_frame_padding()
            ui.dim("Resolution")
            imgui.same_line(0, ui.px(12))
            own = f"Its own {self.picture.dpi[0]:.0f} dpi" if self.picture.dpi else "Not noted"
            chosen = ui.segmented("dpi", (own, f"{PRINTED} dpi"), int(choices.dpi is not None), -1)
            choices.dpi = float(PRINTED) if chosen else None
            if dpi := (choices.dpi, choices.dpi) if choices.dpi else self.picture.dpi:
                across, down = (2.54 * side / per_inch for side, per_inch in zip((width, height), dpi, strict=True))
                ui.dim(f"Prints at {across:.1f} x {down:.1f} cm.")
        if choices.kind == MAP:
            self._ask_about_map(ui)
        elif self._may_ring:
            imgui.align_text_to_frame_padding()
            ui.dim("Pixels")
            imgui.same_line(0, ui.px(12))
            names, uses = [name for _, name, _ in FILTERS], [use for *_, use in FILTERS]
            choices.filter = ui.segmented("filter", names, choices.filter, -1, uses)
        if self.animation:
            seconds, clip = self._seconds, self.clip
            if clip is None or clip.fps is None:
                slid = ui.slider("fps", "Frames a second", choices.fps, 1, 60, default=30)
                choices.fps = float(round(slid.value))
            if seconds > 0:
                self.start = ui.slider("from", "From", self.start, 0, seconds, SECONDS, 0.0).value
                slid = ui.slider("to", "To", self.end, 0, seconds, SECONDS, seconds)
                if slid.changed:  # to what is shown: a slid end has fewer digits than the recording's
                    self._end = slid.value if SECONDS.text(slid.value) != SECONDS.text(seconds) else None
            if clip is None:
                choices.returns = ui.check("Ping-pong", choices.returns)
                ui.tooltip("Ping-pong", more="There and back again: a loop without a jump.")
                if not choices.returns and (most := self._longest_dissolve):
                    more = "How long the end dissolves into the beginning: a loop without a jump that never turns back."
                    slid = ui.slider(
                        "dissolve", "Dissolve the end into the beginning", self._dissolves, 0, most, SECONDS,
                        0.0, title="Dissolve", more=more,
                    )  # fmt: skip
                    choices.dissolve = slid.value if slid.changed else choices.dissolve
            else:
                kept = [word for word, has in (("sound", clip.sound), ("time code", clip.timecode)) if has]
                pace = f"{float(self._rate):.5g} frames a second" if clip.durations is None else "own pace"
                about = f"The clip warped, at its {pace}{', with its ' * bool(kept)}{' and '.join(kept)}."
                ui.wrapped(about, ui.palette.dim, 13)
        if not Sentinel(self.session.recipe.stop, self.session.dt).is_idle:
            ui.wrapped("Ends where the recipe's [stop] is met, if that is earlier.", ui.palette.dim, 13)
        ui.dim("Simulate on the grid")
        choices.finer = ui.segmented("finer", [label for label, _ in FINER], choices.finer, -1)
        if said := self.job().too_fine:  # before a preview takes as long, too
            ui.wrapped(f"{heading(said)}.", ui.palette.text, 13)
        if choices.finer and choices.kind != MAP:
            more = "Finer detail, longer work; it may look a little different from what you see."
            ui.wrapped(more, ui.palette.dim, 13)
            self._show_preview(ui)
        imgui.dummy(ImVec2(0, ui.px(2)))
        ui.dim("File")
        imgui.set_next_item_width(imgui.get_content_region_avail().x - ui.px(104))
        _, self.name = imgui.input_text("##name", self.name)
        imgui.same_line()
        if ui.button("Browse", width=96, height=27):
            self._chooser.ask_where("Export to", self.output, (self.ending,), self._chosen)
        ui.wrapped(str(self.output), ui.palette.dim, 13)
        several = "Files of this name exist, and those of the same numbers will be replaced."
        said = several if is_sequence(self.output) else EXISTS
        self._replaced.tell(ui, self.output, said if is_there(self.output) else "")

    def _choose(self, kind: int) -> None:
        """Take another kind; a name that is still the one proposed goes with it."""
        self.choices.kind = kind
        self.name = self._proposed if self.name == self._named else self.name
        self._named = self._proposed

    @property
    def _proposed(self) -> str:
        """The name of the file, unless the person gives it another."""
        return f"{self.session.project.name} {'map' if self.choices.kind == MAP else 'warped'}"

    def _ask_about_map(self, ui: Ui) -> None:
        choices = self.choices
        choices.forward = bool(
            ui.segmented("direction", ("To the original", "From the original"), int(choices.forward), -1)
        )
        ui.wrapped(
            "For each pixel of the original, where it goes."
            if choices.forward
            else "For each pixel of the result, where it is looked up: what other programs apply.",
            ui.palette.dim,
            13,
        )
        if self.ending in (".exr", ".tif"):
            choices.offsets = bool(
                ui.segmented("values", ("ST map, 0 to 1", "Offsets in pixels"), int(choices.offsets), -1)
            )

    def _show_preview(self, ui: Ui) -> None:
        """What the finer grid makes of it, small, beside what is seen; made in a process of its own."""
        process = self._preview
        if process is None:
            if self._image is None and ui.button("Preview", width=96, height=30):
                job, folder = self.job(), temporary_folder()
                small = job.recipe.output.model_copy(update={"size": min(PREVIEW, self.choices.size)})
                self._folder = folder
                outputs = Outputs(Path(folder.name) / "preview.png")
                self._preview = ExportProcess(replace(job, recipe=job.recipe.edited(output=small), outputs=outputs))
        else:
            process.poll()
            ui.dim(f"Making a preview: {process.part:.0%}")
            if process.is_done:
                self._preview = None
                self.problem = process.error
                if not process.error:
                    self._image = _texture(self.session.device, process.job.target)
        if self._image is not None:
            width = imgui.get_content_region_avail().x
            height = min(width * self._image.height / self._image.width, ui.px(240))
            across = height * self._image.width / self._image.height
            imgui.image(imgui.ImTextureRef(self._image.glo), ImVec2(across, height))

    @property
    def _can_start(self) -> bool:
        return bool(self.name.strip()) and not self._exports.is_running

    def _start(self) -> None:
        session = self.session
        check_pictures_kept(session.document.recipe, session.project.folder, self.output)
        self._exports.start(self.job())
        self._preferences.exported(self.output, self.choices.told)
        name = self.name if self.name != self._named else None
        self._exports.chosen[self.session] = replace(deepcopy(self.choices), name=name)

    def _chosen(self, path: Path) -> None:
        name = printable(path.name)
        self.folder = path.parent
        self.name = name[: -len(self.ending)] if name.endswith(self.ending) else printable(path.stem)


def _texture(device: Device, path: Path) -> moderngl.Texture:
    pixels = shown_pixels(read_picture(path), PREVIEW)
    texture = device.ctx.texture((pixels.shape[1], pixels.shape[0]), 4, pixels.tobytes())
    texture.filter = moderngl.LINEAR, moderngl.LINEAR
    return texture


class StillExporting(Dialog):
    """Asks what shall become of an export that is under way when the person leaves."""

    def __init__(self, exports: Exports, leave: Callable[[], None]) -> None:
        super().__init__("An export is still running")
        self._exports = exports
        self._leave = leave
        self._waits = False

    @property
    def is_busy(self) -> bool:
        return True

    def body(self, ui: Ui) -> bool:
        if not self._exports.is_running:
            # It has ended by itself: well, or with a message that should be read.
            if self._exports.went_well:
                self._leave()
            return False
        words = (
            "fluidwarp closes as soon as it is finished."
            if self._waits
            else "Nothing half-written is kept if it is stopped."
        )
        ui.wrapped(f"{self._exports.name} is {self._exports.part:.0%} done. {words}", ui.palette.dim, 14)
        imgui.dummy(ImVec2(0, ui.px(8)))
        if ui.button("Stop it and quit", width=132):
            self._leave()
            return False
        beside(ui, 132, 96 + 8 + 148)
        if ui.button("Cancel##leaving", width=96):
            return False
        imgui.same_line()
        with ui.enabled(not self._waits):
            if ui.button("Quit when finished", primary=True, width=148) or self.entered:
                self._waits = True
        return True


class Exports:
    """The export that is under way, if any.

    Attributes:
        chosen: what was chosen for the last export of a work.
    """

    def __init__(self, messages: Messages) -> None:
        self.messages = messages
        self.chosen = WeakKeyDictionary[Session, Choices]()
        self.went_well = False  # the last one that has ended
        self._process: ExportProcess | None = None
        self._copied: tempfile.TemporaryDirectory[str] | None = None  # what is on its way to the clipboard
        self._giving: Giving | None = None

    @property
    def is_running(self) -> bool:
        return self._process is not None or self._giving is not None

    @property
    def name(self) -> str:
        """What is being written."""
        return self._process.job.target.name if self._process else ""

    @property
    def part(self) -> float:
        """How much of it is done, 0-1."""
        return self._process.part if self._process else 1.0

    def start(self, job: Job) -> None:
        """Begin a job.

        Raises:
            UserError: if it cannot be written, as far as that can be known beforehand.
        """
        job.check()
        self._process = ExportProcess(job)

    def copy(self, session: Session) -> None:
        """Make the picture that is seen, in its full size, and put it on the clipboard.

        Raises:
            UserError: if that cannot be done, as far as that can be known beforehand.
        """
        check()
        if self.is_running:
            raise UserError("An export is still running; copy the picture when that is finished.")
        recipe = ending_at(session.document.recipe, session.target)
        recipe = recipe.edited(output=recipe.output.model_copy(update={"size": None}))
        folder = temporary_folder()
        outputs = Outputs(Path(folder.name) / "the picture.png", bits=8, recorded=False)
        picture = replace(session.project.picture, note="")
        self.start(Job(recipe, picture, session.project.folder, outputs, frame=session.still))
        self._copied = folder

    def cancel(self) -> None:
        """Stop the job; nothing of it is left once its process has ended, for which nobody waits."""
        copied, self._copied, self._giving = self._copied, None, None
        if self._process is not None:
            self._process.stop(copied.cleanup if copied is not None else lambda: None)
            self._process = None

    def draw(self, ui: Ui, canvas: Rect) -> None:
        """How far it is, with a button to stop it."""
        process = self._process
        if self._giving is not None and self._giving.is_done:
            error, self._giving, self._copied = self._giving.error, None, None
            self.messages.warn(error) if error else self.messages.done("The picture is on the clipboard.")
        if process is None:
            return
        process.poll(lambda said: self.messages.say(heading(said)))
        if process.is_done:
            self._process = None
            self.went_well = not process.error
            if process.error:
                self._copied = None
                self.messages.warn(process.error)
                return
            if verdict := process.outcome.verdict:  # the window plays on where a recipe's [stop] ends an export
                self.messages.say(f"{heading(verdict)}. The recipe's [stop] ended it there.")
            if self._copied is not None:
                self._giving = Giving(process.job.target)
            else:
                for notice in process.outcome.notices:
                    self.messages.say(heading(notice))
                self.messages.done(f"Exported {process.job.target.name} to {process.job.target.parent}")
            return
        state = f": {process.state}" if process.state else ""
        copied = self._copied is not None
        words = f"Copying {process.job.target.stem}" if copied else f"Exporting {process.job.target.name}"
        if under_way(ui, "exporting", canvas, words + state, process.part, "Cancel"):
            self.cancel()
            self.messages.say("Cancelled; no unfinished file is kept.")


def under_way(
    ui: Ui, name: str, canvas: Rect, words: str, part: float, button: str, key: str = "", more: str = ""
) -> bool:
    """What is being done and how much of it, at the canvas's upper edge; True if the button is pressed.

    `button`: what it says; empty where nothing can be stopped.
    """
    width = max(min(ui.px(280), canvas.width - ui.px(140)), ui.px(60))
    middle, half = canvas.middle[0], width / 2 + ui.px(60)
    top = ui.free_below(middle - half, middle + half, canvas.y + ui.px(16))
    if top > canvas.y + ui.px(16) and top + ui.px(60) > canvas.bottom:
        return False  # there is no room for both
    with ui.floating(name, middle, top, (0.5, 0)):
        with imgui_ctx.begin_group():
            with imgui_ctx.push_text_wrap_pos(imgui.get_cursor_pos_x() + width):
                ui.text(words, size=14)
            corner = imgui.get_cursor_screen_pos()
            lines = imgui.get_window_draw_list()
            high = ImVec2(corner.x + width, corner.y + ui.px(5))
            lines.add_rect_filled(corner, high, packed(ui.palette.pressed), ui.px(3))
            done = ImVec2(corner.x + max(width * part, ui.px(5)), high.y)
            lines.add_rect_filled(corner, done, packed(ui.palette.accent), ui.px(3))
            imgui.dummy(ImVec2(width, ui.px(8)))
        if not button:
            return False
        imgui.same_line(0, ui.px(16))
        pressed = ui.button(f"{button}##{name}", height=30)
        if more:
            ui.tooltip(button, key, more)
        return pressed
