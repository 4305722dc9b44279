"""Export from the window: asks what is wanted, and does it in a process of its own, so that the window stays usable.

Long, as the dialog holds a row for each kind of file and setting; the export itself is `app/work/export.py`.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from math import floor
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import moderngl
from imgui_bundle import imgui
from imgui_bundle.imgui import ImVec2

from app.errors import UserError, printable
from app.media.clip import WHOLE, FrameRange, rate_of
from app.media.encoders import written_size
from app.media.formats import FORMATS
from app.media.leftovers import temporary_folder
from app.media.pictures import read_picture
from app.model.handles import heading
from app.model.recipe import Recipe
from app.model.timeline import NEARLY, Timeline, steps_of
from app.ui.canvas import shown_pixels
from app.ui.chooser import FileChooser
from app.ui.clipboard import Giving, check
from app.ui.dialogs import Dialog, beside
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


@dataclass(frozen=True)
class Variant:
    """One way to write a kind of file: what the second row of choices calls it, and what a job's `Outputs` calls it."""

    label: str
    ending: str
    codec: str | None = None
    bits: int | None = None
    animated: bool = False


@dataclass(frozen=True)
class FileKind:
    """A kind of file that can be exported, and what it is good for."""

    name: str
    use: str
    variants: tuple[Variant, ...]


# What the next export of the same work begins with, as it was chosen for the last; not the part of the time, which has
# grown with the work.
KEPT = (
    "kind", "format", "variant", "size", "quality", "fps", "returns", "dissolve", "dpi", "filter", "finer", "forward",
    "offsets",
)  # fmt: skip


@dataclass(frozen=True)
class Preset:
    """What an export is for, and all that is chosen for it.

    Attributes:
        kind, format, variant: positions in `KINDS`, its kinds of file and their variants.
        size: pixels along the longer side at most; None is the picture's own.
        quality: of kinds of file that have one.
        fps: frames a second of an animation.
        returns: an animation goes there and back again.
        dpi: dots per inch noted in a picture; None is the picture's own.
    """

    name: str
    use: str
    kind: int
    format: int
    variant: int = 0
    size: int | None = None
    quality: int = 90
    fps: float = 30.0
    returns: bool = False
    dpi: float | None = None


def _depths(ending: str, *bits: int) -> tuple[Variant, ...]:
    return (Variant("As the picture", ending), *(Variant(f"{n} bits", ending, bits=n) for n in bits))


def _as_it_is(ending: str, animated: bool = False) -> tuple[Variant, ...]:
    return (Variant("", ending, animated=animated),)


def _holds_light(file: FileKind) -> bool:
    """Whether a kind of picture file holds linear light in floats."""
    return 32 in FORMATS[file.variants[0].ending].bits


PICTURES = (
    FileKind("PNG", "Exact, with alpha.", _depths(".png", 8, 16)),
    FileKind("JPEG", "Small; 8 bits a channel, no alpha.", _as_it_is(".jpg")),
    FileKind("WebP", "Small; 8 bits a channel, with alpha. Quality 100 is exact.", _as_it_is(".webp")),
    FileKind("AVIF", "The smallest; 8 bits a channel, with alpha.", _as_it_is(".avif")),
    FileKind("TIFF", "Exact, with alpha; for print.", _depths(".tif", 8, 16, 32)),
    FileKind("EXR", "Linear light, with alpha; for compositing.", _depths(".exr", 16, 32)),
)
ANIMATIONS = (
    FileKind("MP4", "Plays nearly everywhere; no alpha.", (Variant("H.264", ".mp4"), Variant("H.265", ".mp4", "h265"))),
    FileKind(
        "MOV",
        "For editing programs.",
        (Variant("ProRes 4444, with alpha", ".mov"), Variant("ProRes 422 HQ", ".mov", "prores-422-hq")),
    ),
    FileKind("WebM", "For web pages.", (Variant("VP9, with alpha", ".webm"), Variant("AV1", ".webm", "av1"))),
    FileKind("MKV", "Every frame exact, with alpha; large.", _as_it_is(".mkv")),
    FileKind("GIF", "256 colours in all, at most 50 frames a second.", _as_it_is(".gif")),
    FileKind("WebP", "A moving picture of all colours, with alpha; for web pages.", _as_it_is(".webp", True)),
    FileKind("APNG", "A moving picture, exact, with alpha.", _as_it_is(".apng")),
    FileKind(
        "Frames",
        "A numbered file for each frame.",
        tuple(Variant(kind, f".%04d{ending}") for kind, ending in
              (("PNG", ".png"), ("TIFF", ".tif"), ("EXR", ".exr"), ("JPEG", ".jpg"))),
    ),
)  # fmt: skip
MAPS = (
    FileKind("EXR", "ST map or offsets, for Nuke and similar programs.", _as_it_is(".exr")),
    FileKind("TIFF", "The same values.", _as_it_is(".tif")),
    FileKind("FLO", "Offsets in pixels, as optical flow has them.", _as_it_is(".flo")),
    FileKind("NPY", "Offsets in longer sides of the picture, for NumPy.", _as_it_is(".npy")),
)
KINDS = (("Picture", PICTURES), ("Animation", ANIMATIONS), ("Warp map", MAPS))
PICTURE, ANIMATION, MAP = range(3)
PRINTED = 300  # dots per inch that printers ask for
PRESETS = (
    Preset("Web", "JPEG, at most 2048 pixels, quality 85.", PICTURE, 1, size=2048, quality=85),
    Preset("Print", f"TIFF of 16 bits, all pixels, {PRINTED} dpi.", PICTURE, 4, 2, dpi=PRINTED),
    Preset("Film", "ProRes 4444 with alpha, all pixels, 24 frames a second or the clip's own.", ANIMATION, 1, fps=24.0),
    Preset(
        "Loop", "MP4, at most 1280 pixels; ping-pong, so that it has no jump.", ANIMATION, 0, size=1280, returns=True
    ),
)
RATED = (".jpg", ".webp", ".avif", ".mp4", ".webm", ".%04d.jpg")  # endings of files that have a quality
FILTERS = (  # of a recipe, their names, and what they are for
    ("catmull-rom", "Sharp", "Overshoots a little beside hard edges."),
    ("limited", "No ringing", "Sharp, and never darker or brighter than the pixels around; for HDR."),
    ("bilinear", "Soft", "The mean of the pixels around."),
    ("nearest", "Hard", "Each pixel as it is; for pixel art."),
)
PREVIEW = 640  # pixels along the longer side
FINER = (("As seen", 1), ("2 x", 2))


class ExportDialog(Dialog):
    """What is to be written: picture, animation or warp map, size, rate, part.

    Args:
        session: what is exported.
        exports: does it.
        chooser: lets the person look for another place.
        preferences: where it was exported to last.

    Attributes:
        kind: PICTURE, ANIMATION or MAP.
        format: which of its kinds of file, for each of these.
        variant: which of the variants, for each kind of file.
        returns: an animation goes there and back again.
        dpi: dots per inch noted in a picture; None is the picture's own.
        dissolve: seconds in which its end dissolves into its beginning, if it does not return.
        presets: those that there are for it.
        forward: the map tells where the points of the original go.
        offsets: an EXR or TIFF map holds offsets in pixels.
        filter: which of `FILTERS`.
    """

    width, tallest = 500, 664

    def __init__(self, session: Session, exports: Exports, chooser: FileChooser, preferences: Preferences) -> None:
        super().__init__("Export")
        self.session = session
        self._exports = exports
        self._chooser = chooser
        self._preferences = preferences
        self.kind = PICTURE
        self.format = [0 for _ in KINDS]
        self.variant = [[0 for _ in files] for _, files in KINDS]
        self._take_up(preferences.export_as)
        if session.project.clip is not None:
            self.kind = ANIMATION
        if session.project.picture.linear and not _holds_light(PICTURES[self.format[PICTURE]]):
            self.format[PICTURE] = next(number for number, file in enumerate(PICTURES) if file.name == "EXR")
        self.returns, self.dissolve = session.recipe.time.ping_pong, session.recipe.time.dissolve
        # No clip is played backwards.
        self.presets = [preset for preset in PRESETS if not (preset.returns and session.project.clip)]
        self.forward = self.offsets = False
        self.picture = replace(session.project.picture, note="")  # it was told when the picture was opened
        self.size = max(self.picture.width, self.picture.height)
        self.quality = session.recipe.output.quality
        self.fps = session.recipe.output.fps
        self.clip = session.project.clip
        self.filter = [name for name, *_ in FILTERS].index(session.recipe.output.filter)
        # Beside lights that are many times as bright as white it shows, elsewhere hardly.
        self._may_ring = self.picture.linear or self.filter > 0 or (self.clip is not None and self.clip.colours.is_high)
        self.start = 0.0
        self.dpi: float | None = None
        self._end: float | None = None
        self.finer = 0
        self.folder = preferences.export_to
        self._preview: ExportProcess | None = None
        self._image: moderngl.Texture | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        extent, chosen = exports.chosen.get(session, ((0, 0), {}))
        if extent == (self.picture.width, self.picture.height):
            vars(self).update(chosen)
        self._named = self._proposed
        self.name = chosen.get("name", self._named)

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
        return self.kind == ANIMATION

    @property
    def file_kind(self) -> FileKind:
        return KINDS[self.kind][1][self.format[self.kind]]

    @property
    def use(self) -> str:
        """What the kind of file is good for, of this picture."""
        if self.kind == PICTURE and self.picture.linear and not _holds_light(self.file_kind):
            return "What is brighter than white becomes white; EXR and TIFF keep it."
        return self.file_kind.use

    @property
    def how(self) -> Variant:
        return self.file_kind.variants[self.variant[self.kind][self.format[self.kind]]]

    @property
    def ending(self) -> str:
        return self.how.ending

    def _take_up(self, last: str) -> None:
        """Begin with what was exported last, as `_told` tells it."""
        for kind, (label, files) in enumerate(KINDS):
            for number, file in enumerate(files):
                if last == f"{label} {file.name}":
                    self.kind, self.format[kind] = kind, number

    @property
    def _told(self) -> str:
        return f"{KINDS[self.kind][0]} {self.file_kind.name}"

    def take(self, preset: Preset) -> None:
        """Choose all that a preset says; place and part stay."""
        self._choose(preset.kind)
        self.format[preset.kind] = preset.format
        self.variant[preset.kind][preset.format] = preset.variant
        self.size, self.quality, self.fps, self.returns, self.dpi = self._of(preset)
        self.dissolve = 0.0

    def _of(self, preset: Preset) -> tuple[int, int, float, bool, float | None]:
        own = max(self.picture.width, self.picture.height)
        return min(own, preset.size or own), preset.quality, preset.fps, preset.returns, preset.dpi

    @property
    def preset(self) -> int:
        """The one that says what is chosen; -1 if none does."""
        chosen = self.kind, self.format[self.kind], self.variant[self.kind][self.format[self.kind]]
        now = self.size, self.quality, self.fps, self.returns, self.dpi
        for number, preset in enumerate(self.presets):
            is_plain = not (self.animation and self.dissolve)
            if is_plain and chosen == (preset.kind, preset.format, preset.variant) and now == self._of(preset):
                return number
        return -1

    @property
    def output(self) -> Path:
        return self.folder / (self.name + self.ending)

    def job(self) -> Job:
        """What the person has asked for."""
        session = self.session
        recipe = session.document.recipe
        if not self.animation:
            # The picture that is seen: the warp at the playhead.
            recipe = recipe.edited(duration=max(session.target, 1) * recipe.fluid.dt)
        grid = min(recipe.fluid.grid * FINER[self.finer][1], 1024)
        own = max(self.picture.width, self.picture.height)
        output = recipe.output.model_copy(
            update={"size": None if self.size == own else self.size, "fps": self.fps, "quality": self.quality}
        ).model_copy(update={"filter": FILTERS[self.filter][0]})
        part = recipe.time.model_copy(
            update={
                "start": self.start,
                "end": max(self.end, self.start),
                "ping_pong": self.returns,
                "dissolve": 0.0 if self.returns else self._dissolves,
            }
        )
        recipe = recipe.edited(
            output=output,
            time=part if self.animation and self.clip is None else recipe.time,
            fluid=recipe.fluid if grid == recipe.fluid.grid else recipe.fluid.model_copy(update={"grid": grid}),
        )
        if self.kind == MAP:
            maps = MapOutput(self.output, "offsets" if self.offsets else "st", self.forward)
            return Job(recipe, self.picture, session.project.folder, Outputs(None, maps=maps), self.clip)
        how = self.how
        outputs = Outputs(self.output, animated=how.animated, bits=how.bits, codec=how.codec, recorded=False)
        if self.animation:
            outputs = replace(outputs, part=self._frames)
        elif self._holds_dpi:
            outputs = replace(outputs, dpi=self.dpi)
        return self._of_seen(recipe, outputs)

    def _of_seen(self, recipe: Recipe, outputs: Outputs) -> Job:
        """What is done to the clip, or to the picture that is seen."""
        folder, frame = self.session.project.folder, self.session.still
        if self.animation:
            return Job(recipe, self.picture, folder, outputs, self.clip)
        return Job(recipe, self.picture, folder, outputs, frame=frame)

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
        frames = steps_of(Timeline.of(recipe), shown, self.fps) // 2
        return frames / self.fps if frames > 1 else 0.0

    @property
    def _dissolves(self) -> float:
        """Seconds: as asked for, but no less than two frames, and no more than there is."""
        asked = 0.0 if self.dissolve < 1 / self.fps else max(self.dissolve, 2 / self.fps)
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
        size = longer_side(own, self.size)
        return written_size(f"frames{self.ending}", size) if self.animation else size

    @property
    def _holds_dpi(self) -> bool:
        return self.kind == PICTURE and "dpi" in FORMATS[self.ending].keeps

    @property
    def _rate(self) -> Fraction:
        """Frames a second of what is written."""
        return rate_of(self.clip, self.fps)

    def body(self, ui: Ui) -> bool:
        imgui.align_text_to_frame_padding()
        ui.dim("Preset")
        imgui.same_line(0, ui.px(12))
        names, uses = [preset.name for preset in self.presets], [preset.use for preset in self.presets]
        chosen = ui.segmented("preset", names, now := self.preset, -1, uses)
        if chosen != now:
            self.take(self.presets[chosen])
        self._choose(ui.segmented("kind", [label for label, _ in KINDS], self.kind, -1))
        files, chosen = KINDS[self.kind][1], self.format[self.kind]
        chosen = self.format[self.kind] = ui.segmented("format", [file.name for file in files], chosen, -1)
        if len(variants := self.file_kind.variants) > 1:
            labels, now = [variant.label for variant in variants], self.variant[self.kind][chosen]
            self.variant[self.kind][chosen] = ui.segmented("variant", labels, now, -1)
        ui.wrapped(self.use, ui.palette.dim, 13)
        own = max(self.picture.width, self.picture.height)
        width, height = self.written
        unit, shown = Unit(" pixels", self.picture.width / own), f"{width} x {height} pixels"
        slid = ui.slider("size", "Size", self.size, 16, max(own * 2, 64), unit, own, shown)
        self.size = round(slid.value)
        if self.ending in RATED and not self.how.animated:
            slid = ui.slider("quality", "Quality", self.quality, 1, 100, default=90)
            self.quality = round(slid.value)
        if self._holds_dpi:
            imgui.align_text_to_frame_padding()
            ui.dim("Resolution")
            imgui.same_line(0, ui.px(12))
            own = f"Its own {self.picture.dpi[0]:.0f} dpi" if self.picture.dpi else "Not noted"
            chosen = ui.segmented("dpi", (own, f"{PRINTED} dpi"), int(self.dpi is not None), -1)
            self.dpi = float(PRINTED) if chosen else None
            if dpi := (self.dpi, self.dpi) if self.dpi else self.picture.dpi:
                across, down = (2.54 * side / per_inch for side, per_inch in zip((width, height), dpi, strict=True))
                ui.dim(f"Prints at {across:.1f} x {down:.1f} cm.")
        if self.kind == MAP:
            self._ask_about_map(ui)
        elif self._may_ring:
            imgui.align_text_to_frame_padding()
            ui.dim("Pixels")
            imgui.same_line(0, ui.px(12))
            names, uses = [name for _, name, _ in FILTERS], [use for *_, use in FILTERS]
            self.filter = ui.segmented("filter", names, self.filter, -1, uses)
        if self.animation:
            seconds, clip = self._seconds, self.clip
            if clip is None or clip.fps is None:
                slid = ui.slider("fps", "Frames a second", self.fps, 1, 60, default=30)
                self.fps = float(round(slid.value))
            if seconds > 0:
                self.start = ui.slider("from", "From", self.start, 0, seconds, SECONDS, 0.0).value
                slid = ui.slider("to", "To", self.end, 0, seconds, SECONDS, seconds)
                self._end = (slid.value if slid.value < seconds else None) if slid.changed else self._end
            if clip is None:
                self.returns = ui.check("Ping-pong", self.returns)
                ui.tooltip("Ping-pong", more="There and back again: a loop without a jump.")
                if not self.returns and (most := self._longest_dissolve):
                    more = "How long the end dissolves into the beginning: a loop without a jump that never turns back."
                    slid = ui.slider(
                        "dissolve", "Dissolve the end into the beginning", self._dissolves, 0, most, SECONDS,
                        0.0, title="Dissolve", more=more,
                    )  # fmt: skip
                    self.dissolve = slid.value if slid.changed else self.dissolve
            else:
                kept = [word for word, has in (("sound", clip.sound), ("time code", clip.timecode)) if has]
                pace = f"{float(self._rate):.5g} frames a second" if clip.durations is None else "own pace"
                about = f"The clip warped, at its {pace}{', with its ' * bool(kept)}{' and '.join(kept)}."
                ui.wrapped(about, ui.palette.dim, 13)
        ui.dim("Simulate on the grid")
        self.finer = ui.segmented("finer", [label for label, _ in FINER], self.finer, -1)
        if self.finer and self.kind != MAP:
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
        if os.path.exists(self.output):
            ui.text("This file exists and will be replaced.", ui.palette.accent, 13)
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
                return not self.attempt(self._start)
        return True

    def _choose(self, kind: int) -> None:
        """Take another kind; a name that is still the one proposed goes with it."""
        self.kind = kind
        self.name = self._proposed if self.name == self._named else self.name
        self._named = self._proposed

    @property
    def _proposed(self) -> str:
        """The name of the file, unless the person gives it another."""
        return f"{self.session.project.name} {'map' if self.kind == MAP else 'warped'}"

    def _ask_about_map(self, ui: Ui) -> None:
        self.forward = bool(ui.segmented("direction", ("To the original", "From the original"), int(self.forward), -1))
        ui.wrapped(
            "For each pixel of the original, where it goes."
            if self.forward
            else "For each pixel of the result, where it is looked up: what other programs apply.",
            ui.palette.dim,
            13,
        )
        if self.ending in (".exr", ".tif"):
            self.offsets = bool(ui.segmented("values", ("ST map, 0 to 1", "Offsets in pixels"), int(self.offsets), -1))

    def _show_preview(self, ui: Ui) -> None:
        """What the finer grid makes of it, small, beside what is seen; made in a process of its own."""
        process = self._preview
        if process is None:
            if self._image is None and ui.button("Preview", width=96, height=30):
                job, folder = self.job(), temporary_folder()
                small = job.recipe.output.model_copy(update={"size": min(PREVIEW, self.size)})
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
        self._exports.start(self.job())
        self._preferences.exported(self.output, self._told)
        extent = self.picture.width, self.picture.height
        kept = (*KEPT, "name") if self.name != self._named else KEPT
        self._exports.chosen[self.session] = extent, {name: vars(self)[name] for name in kept}

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
        chosen: what was chosen for the last export of a work, and the size of its picture, pixels.
    """

    def __init__(self, messages: Messages) -> None:
        self.messages = messages
        self.chosen = WeakKeyDictionary[Session, tuple[tuple[int, int], dict[str, Any]]]()
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
        recipe = session.document.recipe
        recipe = recipe.edited(
            duration=max(session.target, 1) * recipe.fluid.dt,
            output=recipe.output.model_copy(update={"size": None}),
        )
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
        process.poll()
        if process.is_done:
            self._process = None
            self.went_well = not process.error
            if process.error:
                self._copied = None
                self.messages.warn(process.error)
            elif self._copied is not None:
                self._giving = Giving(process.job.target)
            else:
                for notice in process.notices:
                    self.messages.say(heading(notice))
                self.messages.done(f"Exported {process.job.target.name} to {process.job.target.parent}")
            return
        state = f": {process.state}" if process.state else ""
        copied = self._copied is not None
        words = f"Copying {process.job.target.stem}" if copied else f"Exporting {process.job.target.name}"
        if under_way(ui, "exporting", canvas, 0.0, words + state, process.part, "Cancel"):
            self.cancel()
            self.messages.say("Cancelled; no unfinished file is kept.")


def under_way(
    ui: Ui, name: str, canvas: Rect, down: float, words: str, part: float, button: str, key: str = "", more: str = ""
) -> bool:
    """What is being done and how much of it, so many points below the canvas's edge; True if the button is pressed.

    `button`: what it says; empty where nothing can be stopped.
    """
    with ui.floating(name, canvas.x + canvas.width / 2, canvas.y + ui.px(16 + down), (0.5, 0)):
        imgui.begin_group()
        width = max(min(ui.px(280), canvas.width - ui.px(140)), ui.px(60))
        imgui.push_text_wrap_pos(imgui.get_cursor_pos_x() + width)
        ui.text(words, size=14)
        imgui.pop_text_wrap_pos()
        corner = imgui.get_cursor_screen_pos()
        lines = imgui.get_window_draw_list()
        high = ImVec2(corner.x + width, corner.y + ui.px(5))
        lines.add_rect_filled(corner, high, packed(ui.palette.pressed), ui.px(3))
        done = ImVec2(corner.x + max(width * part, ui.px(5)), high.y)
        lines.add_rect_filled(corner, done, packed(ui.palette.accent), ui.px(3))
        imgui.dummy(ImVec2(width, ui.px(8)))
        imgui.end_group()
        if not button:
            return False
        imgui.same_line(0, ui.px(16))
        pressed = ui.button(f"{button}##{name}", height=30)
        if more:
            ui.tooltip(button, key, more)
        return pressed
