"""Jobs: a picture, a recipe, and all that is written of them; checked before the work begins."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from math import isclose
from pathlib import Path
from typing import Any

from app.errors import UserError
from app.media.animation import AnimationOptions
from app.media.clip import USUAL, WHOLE, Clip, FrameRange, rate_of, uncoded
from app.media.codecs.jpeg import held_dpi
from app.media.encoders import check_colours, check_colours_of_picture, check_output, is_animation
from app.media.files import cannot_write, writable
from app.media.formats import picture_format
from app.media.holding import Losses, Written
from app.media.inputs import MAX_PIXELS
from app.media.maps import Kind, check_map
from app.media.numbered import check_number, is_sequence
from app.media.opening import check_picture
from app.media.pictures import write_picture
from app.model.picture import Picture
from app.model.recipe import UNNAMED, Recipe
from solver.grid import SMALLEST_GRID


@dataclass(frozen=True)
class MapOutput:
    """What is written of the warp map.

    Attributes:
        path: a file for the last frame's map, or the pattern of a sequence for every frame's; see `app.media.maps`.
        kind: what an EXR or TIFF holds.
        forward: where the points of the original go, instead of where those of the result come from.
        overscan: pixels more on every side.
        size: longer side in pixels; None is the result's.
    """

    path: Path
    kind: Kind = "st"
    forward: bool = False
    overscan: int = 0
    size: int | None = None

    @property
    def is_sequence(self) -> bool:
        return is_sequence(self.path)


@dataclass(frozen=True)
class Outputs:
    """What is written, and how.

    Attributes:
        file: the result, or the pattern of a sequence's files; None for maps alone.
        stats: a JSON file for numbers about every frame.
        maps: what is written of the warp map.
        part: the first and the last frame of the animation that are written, from 0, or by the numbers of the files
            that it is made from; None is to the end.
        animated: for endings that stand for both, as .webp does: an animation is wanted.
        bits: a channel, of pictures; None keeps the source's.
        strip: leave out the source's metadata.
        codec: of a video; None is the usual one of its ending.
        states: a folder of states of the simulation, for parts to begin with and to leave for others.
        resume: keep the files of a sequence that are whole, and were made of the same.
        dpi: dots per inch that a picture is said to have; None keeps the source's.
        recorded: leave beside the files of a sequence what resuming looks at.
    """

    file: Path | None
    stats: Path | None = None
    maps: MapOutput | None = None
    part: FrameRange = WHOLE
    animated: bool = False
    bits: int | None = None
    strip: bool = False
    codec: str | None = None
    states: Path | None = None
    resume: bool = False
    recorded: bool = True
    dpi: float | None = None

    @property
    def files(self) -> list[Path]:
        """The names of all that is written; states, which others may use as well, are not among them."""
        return [path for path in (self.file, self.stats, self.maps and self.maps.path) if path is not None]

    @property
    def is_animation(self) -> bool:
        return self.file is not None and (self.animated or is_animation(self.file))

    @property
    def has_frames(self) -> bool:
        """True if more than the end is written."""
        return self.is_animation or (self.file is None and self.maps is not None and self.maps.is_sequence)

    def check(self) -> None:
        """Raise `UserError` for names and options that do not go with what is written."""
        for path in self.files:
            check_number(path)
        if self.resume and not any(map(is_sequence, self.files)):
            raise UserError(f"--resume needs a sequence, such as f.%04d.png, and {self.files[0]} is none; leave it out")
        if self.resume and self.stats is not None:
            raise UserError("--stats needs all frames, and --resume makes only the missing ones; use one of them")
        if self.part != WHOLE and not self.has_frames:
            raise UserError(f"--frames is for an animation, and {self.file} is a picture; write f.%04d.png or .mp4")
        if self.dpi is None:
            return
        if self.file is None or self.is_animation:
            raise UserError("--dpi is for a single picture, and none is written; leave it out")
        if picture_format(self.file).name == "JPEG" and not isclose(held_dpi((self.dpi, self.dpi))[0], self.dpi):
            raise UserError(f"JPEG holds whole dots per inch, not {self.dpi:g}; round --dpi, or write a PNG or TIFF")

    def check_room(self, picture: Picture, clip: Clip | None, size: tuple[int, int], rate: Fraction) -> None:
        """Raise `UserError` if `file` is of no kind for this picture or clip, in a size and at a rate.

        The colours come first: for what is too large, or shown too fast, another kind is advised that has them as well.
        """
        assert self.file is not None
        kind = {"animated": self.animated, "codec": self.codec, "bits": self.bits}
        check_output(self.file, **kind)
        if clip is not None:
            check_colours(self.file, self.codec, clip, self.is_animation, size)
        check_colours_of_picture(self.file, self.codec, picture, self.is_animation, size)
        for steps in set((clip and clip.lengths(self.part)) or [1]):
            check_output(self.file, **kind, fps=rate / steps, size=size)

    def losses(self, **how: Any) -> Losses:
        """For what of the pictures `file` does not hold; `how` is as in `Written`."""
        assert self.file is not None
        common = {"bits": self.bits, "codec": self.codec, "strip": self.strip, "with_dpi": self.dpi is None}
        return Losses(self.file, Written(**common, **how))

    def write(self, picture: Picture, quality: int, whole: Callable[[Path], None]) -> None:
        """Write a picture to `file` as is asked for; see `write_picture`."""
        assert self.file is not None
        write_picture(
            self.file, picture, bits=self.bits, quality=quality, strip=self.strip, codec=self.codec, dpi=self.dpi,
            whole=whole,
        )  # fmt: skip

    def animation(
        self, first: int, rate: Fraction, quality: int | None, like: Picture, clip: Clip | None
    ) -> AnimationOptions:
        """How the animation is written from its frame `first` on: with the sound, times and colours of a clip."""
        last = self.part[1]
        how = AnimationOptions(
            codec=self.codec,
            quality=quality,
            bits=self.bits,
            frames=None if last is None else last + 1 - first,
            like=like.stripped() if self.strip else like,
            colours=uncoded(like.chunks) or USUAL,
            resumed=self.resume,
        )
        if clip is None:
            return how
        return replace(
            how,
            loops=clip.loops,
            durations=clip.lengths(self.part),
            sound=clip.path if clip.sound else None,
            sound_from=float((first - clip.start) / rate) + clip.late,
            colours=how.colours if clip.colours.is_usual else clip.colours,
            timecode=clip.timecode_at(first),
        )

    def renamed(self, name: Callable[[Path], Path]) -> Outputs:
        """The same written to other files, each as `name` says."""
        file, stats, states = (path and name(path) for path in (self.file, self.stats, self.states))
        maps = self.maps and replace(self.maps, path=name(self.maps.path))
        return replace(self, file=file, stats=stats, maps=maps, states=states)


# Cells a pixel, and cells along the longer side, up to which no grid is too fine: the window offers so many.
TOO_FINE, USUAL_GRID = 4, 384


@dataclass(frozen=True)
class Job:
    """What is made of what.

    Attributes:
        recipe: all settings; its [output] says the size and the rate.
        picture: the source; of a clip, its first frame.
        folder: where the names of auxiliary pictures in the recipe start from.
        outputs: what is written.
        clip: the source, where it moves: its frames are warped by W_t at its own rate, its sound is carried over.
        frame: of a picture, the frame of a clip that is warped, by its number, where it is not `picture`.
        named_by: what the recipe is called, for what is told of the files it names.
    """

    recipe: Recipe
    picture: Picture
    folder: Path
    outputs: Outputs
    clip: Clip | None = None
    frame: tuple[Clip, int] | None = None
    named_by: str = UNNAMED

    @property
    def target(self) -> Path:
        """The file that it is all about."""
        output, maps = self.outputs.file, self.outputs.maps
        path = output or (maps and maps.path)
        assert path is not None
        return path

    @property
    def label(self) -> str:
        """What the user calls it."""
        return self.target.name

    @property
    def rate(self) -> Fraction:
        """Frames per second."""
        return rate_of(self.clip, self.recipe.output.fps)

    @property
    def too_fine(self) -> str:
        """That its grid is far finer than the picture, which takes far longer, in a sentence; "" if it is not."""
        width, height = self.picture.width, self.picture.height
        cells, pixels = self.recipe.fluid.grid, max(width, height)
        if cells <= max(USUAL_GRID, TOO_FINE * pixels):
            return ""
        finer = f"{cells / pixels:.3g} times as fine as the picture of {width} x {height} pixels"
        return f"a grid of {cells} cells is {finer}, and takes long; one of {max(pixels, SMALLEST_GRID)} is as fine"

    def check(self) -> None:
        """Find out before the work what would keep it from being written.

        Raises:
            UserError: naming the file and the mend.
        """
        check_picture(self.picture)
        outputs = self.outputs
        output, maps = outputs.file, outputs.maps
        if output is not None:
            outputs.check_room(self.picture, self.clip, result_size(self.recipe, self.picture), self.rate)
        if maps is not None:
            check_map(maps.path)
            self._check_map_size(maps)
            if maps.is_sequence and not outputs.has_frames:
                raise UserError(
                    f"{maps.path} numbers the maps of an animation and {output} is a picture; "
                    f"give one map's name, or leave out --output to write the maps alone"
                )
        start, end = self.recipe.time.start, self.recipe.duration
        if outputs.has_frames and start > end:
            late = f"the animation ends at {end:g} s, and cannot begin at {start:g} s"
            raise UserError(f"{late}; give an earlier --from, or 'time.start'", in_window=late)
        if self.clip is not None and outputs.has_frames:
            self.clip.check(outputs.part)
        if outputs.has_frames and self.recipe.time.dissolve:
            if self.clip is not None:
                raise UserError(f"'time.dissolve' is for a picture, and {self.clip.path} is a clip; leave it out")
            if maps is not None and maps.is_sequence:
                raise UserError(f"a map cannot show a dissolve; leave out {maps.path}, or 'time.dissolve'")
        outputs.check()
        if outputs.file is not None:
            check_result(result_size(self.recipe, self.picture), self.picture, "--size, or 'output.size',")
        if self.clip is not None and self.recipe.mode == "density":
            raise UserError(
                f'mode "density" moves the values of one picture, and {self.clip.path} is a clip; give a picture'
            )
        for path in outputs.files:
            writable(path)
        if outputs.states is not None and os.path.exists(outputs.states) and not os.path.isdir(outputs.states):
            raise cannot_write(outputs.states, FileExistsError(errno.EEXIST, "it is a file"))

    def _check_map_size(self, maps: MapOutput) -> None:
        size = result_size(self.recipe, self.picture)
        width, height = size if maps.size is None else longer_side(size, maps.size)
        why = "the size of the result" if maps.size is None else f"--map-size {maps.size}"
        mend = "ask for fewer by --map-size" if maps.size is None else "ask for fewer"
        if width * height <= MAX_PIXELS:
            width, height = width + 2 * maps.overscan, height + 2 * maps.overscan
            why, mend = f"--overscan {maps.overscan}", "ask for fewer"
        if width * height > MAX_PIXELS:
            large = f"a map of {width} x {height} pixels"
            raise UserError(f"{why} makes {large}; {mend}", in_window=f"{large} is too large; choose a smaller size")


def longer_side(size: tuple[int, int], longest: int) -> tuple[int, int]:
    """A size of the same proportions, its longer side `longest` pixels."""
    width, height = (max(1, round(side * longest / max(size))) for side in size)
    return width, height


def check_result(size: tuple[int, int], picture: Picture, by: str = "--size") -> None:
    """Raise `UserError` for more pixels than are read, and than the picture has; `by` says what asks for them."""
    if size[0] * size[1] > max(MAX_PIXELS, picture.width * picture.height):
        large = f"a result of {size[0]} x {size[1]} pixels"
        raise UserError(
            f"{by} asks for {large}, and at most {MAX_PIXELS} are made; ask for less",
            in_window=f"{large} is too large; choose a smaller size",
        )


def result_size(recipe: Recipe, picture: Picture) -> tuple[int, int]:
    """(width, height) of the result in pixels: the recipe's size, or the picture's own."""
    own = picture.width, picture.height
    return own if recipe.output.size is None else longer_side(own, recipe.output.size)
