"""Maps that were made before, or elsewhere: pictures and clips warped by them, and maps turned round."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from itertools import repeat
from pathlib import Path

import numpy as np

from app.errors import UserError
from app.media import maps
from app.media.animation import animation_writer, check_output, crf_of, is_animation, passes, unheld_of_clip
from app.media.files import check_kept, is_sequence, number_in, writable
from app.media.formats import picture_format, unheld
from app.media.inputs import MAX_PIXELS
from app.media.maps import Displacement, Kind, cropped, folds, read_map
from app.media.opening import Source, open_source
from app.media.pictures import write_picture
from app.model.picture import Picture
from app.model.timeline import frame_rate
from app.progress import Progress
from app.work.along import along, widened
from app.work.export import looked_up, steps_for, write_all
from app.work.jobs import longer_side
from app.work.threads import ahead
from solver.gl.device import Device
from solver.gl.field import FieldError
from solver.grid import Grid
from solver.resample.plan import Edges, GivenMap, Quality, Sampling, SamplingError
from solver.resample.sampler import Sampler
from solver.warp.inverse import ForwardMap
from solver.warp.map import WarpMap

MOST_CELLS = 1024  # along the longer side, for turning a map round


@dataclass(frozen=True)
class MapSource:
    """One map, or the pattern of a sequence of them, and what is in it; see `app.media.maps.read_map` for the rest."""

    path: Path
    kind: Kind | None = None
    grid: maps.Grid | None = None
    overscan: int | None = None
    max_pixels: int = MAX_PIXELS

    @property
    def is_sequence(self) -> bool:
        return is_sequence(self.path)

    def files(self) -> dict[int, Path]:
        """The map's file, or those of the sequence in the order of their numbers.

        Raises:
            UserError: if there is none.
        """
        if not self.is_sequence:
            return {0: self.path}
        try:
            numbers = [(number_in(self.path, file.name), file) for file in self.path.parent.iterdir()]
        except OSError as error:
            raise UserError(f"Cannot read {self.path}: {error.strerror}.") from None
        numbered = sorted((number, file) for number, file in numbers if number is not None)
        if not numbered:
            raise UserError(f"Cannot read {self.path}: there is no such file; check the name.")
        return dict(numbered)

    def read(self) -> Iterator[Displacement]:
        """The maps, one after the other. Raises `UserError`."""
        for file in self.files().values():
            yield read_map(file, kind=self.kind, grid=self.grid, overscan=self.overscan, max_pixels=self.max_pixels)


@dataclass(frozen=True)
class Application:
    """What is warped by which map, and what is written.

    Attributes:
        maps: of a sequence, map k warps frame k, or makes frame k of a picture's animation; the last one stays.
        source: the picture or clip.
        output: a picture's file, an animation's, or the pattern of a sequence.
        edges, size, quality, bits, strip, codec: as in a recipe's job.
        fps: of a picture's animation; a clip keeps its own rate.
    """

    maps: MapSource
    source: Path
    output: Path
    edges: Edges = "transparent"
    size: int | None = None
    quality: int = 90
    fps: float = 30.0
    bits: int | None = None
    strip: bool = False
    codec: str | None = None

    def check(self) -> None:
        """Find out before the work what would keep it from being written. Raises `UserError`."""
        check_output(self.output, fps=self.fps, codec=self.codec, bits=self.bits)
        maps.check_map(self.maps.path)
        writable(self.output)
        for source in (self.source, *self.maps.files().values()):
            check_kept(source, self.output)

    def run(self, device: Device, progress: Progress) -> tuple[str, ...]:
        """Do it, once it has been checked; nothing is left behind if it is cancelled or fails.

        Says what the user should hear of.

        Raises:
            UserError: if a map has other proportions than the picture, or anything cannot be read or written.
        """
        progress.enter("reading")
        animated = is_animation(self.output)
        source = open_source(self.source, self.maps.max_pixels)
        notices = [source.picture.note]
        check_output(self.output, size=self._size(source))
        if animated != (self.maps.is_sequence or source.clip is not None):
            what = "a still" if not animated else "an animation"
            mend = "write f.%04d.png or .mp4" if not animated else "write a picture, such as out.png"
            given = "several maps or a clip" if not animated else "one map and one picture"
            raise UserError(f"Cannot write {self.output}: {given} do not make {what}; {mend}.")
        with Applier(device, self.edges, source.picture.premultiplied) as applier:
            if animated:
                notices.append(unheld(self.output, source.picture, with_layers=False, with_margins=False))
                notices += [unheld_of_clip(self.output, self.codec, source.clip)] if source.clip else []
                self._write_frames(applier, source, progress, notices)
            else:
                self._write_still(applier, source.picture, self._size(source), progress, notices)
            notices.extend(applier.notices(self.maps.path))
        return tuple(filter(None, notices))

    def _write_still(
        self, applier: Applier, picture: Picture, size: tuple[int, int], progress: Progress, notices: list[str]
    ) -> None:
        steps = steps_for(size)
        progress.total = 2 * steps
        given = next(self.maps.read())
        # what lies beyond the display window has a place in a map of the same pixels only
        fits = not given.forward and size == (given.width, given.height) == (picture.width, picture.height)
        notices.append(unheld(self.output, picture, with_margins=fits))
        keeps = picture_format(self.output).keeps
        if not fits or "wide" not in keeps:
            picture = picture.cropped()
        pixels = picture.pixels
        if picture.wide is not None:
            pixels, given = picture.wide, Displacement(widened(given, picture.margins))
            size = pixels.shape[1], pixels.shape[0]
        heard = progress.parts(steps, size[1])
        progress.enter("")
        found = applier.warped(given, pixels, size, self._alpha, heard)
        look_up = partial(applier.looked_up, given, size, lambda rows: progress.check())
        layers = along(picture.layers, look_up) if "layers" in keeps else ()
        if picture.wide is None:
            picture = replace(picture.with_pixels(found), layers=layers)
        else:
            picture = picture.with_wide(found, layers)
        progress.enter("writing")
        write_picture(self.output, picture, bits=self.bits, quality=self.quality, strip=self.strip, codec=self.codec)
        progress.count(steps)

    @property
    def _alpha(self) -> bool:
        return not is_animation(self.output) and picture_format(self.output).alpha

    def _size(self, source: Source) -> tuple[int, int]:
        own = source.picture.width, source.picture.height
        return own if self.size is None else longer_side(own, self.size)

    def _write_frames(self, applier: Applier, source: Source, progress: Progress, notices: list[str]) -> None:
        clip = source.clip
        frames = clip.frames if clip else len(self.maps.files())
        progress.total = frames and frames * passes(self.output)
        progress.enter("")
        size, like = self._size(source), source.picture.stripped() if self.strip else source.picture
        writer = animation_writer(
            self.output,
            clip.fps if clip else frame_rate(self.fps),
            codec=self.codec,
            crf=crf_of(self.quality),
            quality=self.quality,
            bits=self.bits,
            sound=clip.path if clip and clip.sound else None,
            sound_from=clip.late if clip else 0.0,
            like=like,
            cancel=progress.cancel,
            passed=progress.advance,
        )
        with ExitStack() as stack:
            given_maps, source_frames = self.maps.read(), repeat(source.picture.pixels)
            if clip:
                source_frames = stack.enter_context(ahead(clip.read_frames(progress.cancel, notices.append)))
                given_maps = _staying(given_maps)
            warped = (
                applier.warped(given, pixels, size, self._alpha, lambda rows: progress.check())
                for given, pixels in zip(given_maps, source_frames, strict=False)
            )
            write_all(warped, writer, progress)


class Applier:
    """Looks pictures up through given maps; keeps the last map on the GPU, as most stay for many frames."""

    def __init__(self, device: Device, edges: Edges, premultiplied: bool = False) -> None:
        self._device = device
        self._how = Sampling(edges=edges, premultiplied=premultiplied)
        self._sampler = Sampler(device)
        self._given: Displacement | None = None
        self._map: GivenMap | None = None
        self._folds: list[int] = []  # of the maps that fold over themselves, in how many pixels each

    def __enter__(self) -> Applier:
        return self

    def __exit__(self, *exception: object) -> None:
        self._sampler.release()
        if self._map is not None:
            self._map.release()

    def warped(
        self, given: Displacement, pixels: np.ndarray, size: tuple[int, int], alpha: bool, heard: Callable[[int], None]
    ) -> np.ndarray:
        """The pixels looked up through the map, in another size; for `alpha` and `heard` see `looked_up`."""
        return self._looked_up(given, pixels, size, self._how, alpha, heard)

    def looked_up(
        self,
        given: Displacement,
        size: tuple[int, int],
        heard: Callable[[int], None],
        pixels: np.ndarray,
        quality: Quality,
    ) -> np.ndarray:
        """The same of a layer's pixels, in a quality of its own."""
        how = replace(self._how, quality=quality, premultiplied=False)
        return self._looked_up(given, pixels, size, how, False, heard)

    def _looked_up(
        self,
        given: Displacement,
        pixels: np.ndarray,
        size: tuple[int, int],
        how: Sampling,
        alpha: bool,
        heard: Callable[[int], None],
    ) -> np.ndarray:
        try:
            if given is not self._given or self._map is None:
                if self._map is not None:
                    self._map.release()
                inverse = inverted(self._device, given) if given.forward else given
                values = cropped(inverse.fitted(pixels.shape[1], pixels.shape[0])).values
                if folded := folds(values):
                    self._folds.append(folded)
                self._map, self._given = GivenMap(self._device, values), given
            return looked_up(self._sampler, self._map, pixels, size, how, alpha, heard)
        except (SamplingError, FieldError) as error:
            raise UserError(f"The map cannot be applied: {error}.") from None

    def notices(self, path: Path) -> list[str]:
        """What the user should hear of the maps of `path`."""
        if not self._folds:
            return []
        if is_sequence(path):
            return [
                f"folds in {len(self._folds)} of the maps {path.name}, the worst in {max(self._folds)} of its pixels"
            ]
        return [f"{path.name} folds over itself in {self._folds[0]} of its pixels"]


def inverted(device: Device, given: Displacement) -> Displacement:
    """The map the other way round: where the points of the original go, if it told where they come from.

    Raises:
        UserError: if the map is too small, too narrow or too large to be looked up.
    """
    values = cropped(given).values
    width, height = given.width, given.height
    grid = Grid.for_picture(width, height, min(max(width, height), MOST_CELLS))
    warp = WarpMap(device, grid, (width, height))
    try:
        warp.set(values)
        with ForwardMap(warp) as forward:
            found = forward.read((width, height))
    except FieldError as error:
        raise UserError(f"the map cannot be turned round: {error}") from None
    finally:
        warp.release()
    return Displacement(found.astype(np.float32), 0, not given.forward)


def _staying(given: Iterator[Displacement]) -> Iterator[Displacement]:
    """The maps, and then the last of them for ever."""
    last = next(given)
    yield last
    for last in given:
        yield last
    yield from repeat(last)


def converted(source: MapSource, output: Path, kind: Kind, invert: bool, progress: Progress) -> tuple[str, ...]:
    """Write a map, or a sequence of maps, in another format, whole or not at all. Says what the user should hear of.

    Raises:
        UserError: if one cannot be read or written.
    """
    maps.check_map(output)
    writable(output)
    files = source.files()
    for file in files.values():
        check_kept(file, output)
    progress.total = len(files)
    if is_sequence(output) != source.is_sequence:
        raise UserError(f"{source.path} and {output} must both be sequences, or neither")
    with ExitStack() as stack:
        device = stack.enter_context(Device.headless()) if invert else None
        if source.is_sequence:
            writer = maps.map_writer(output, kind, first=next(iter(files)), cancel=progress.cancel)
            write = stack.enter_context(writer)
        else:
            write = partial(maps.write_map, output, kind=kind)
        notices = []
        for file, given in zip(files.values(), source.read(), strict=True):
            if device and (folded := folds(cropped(given).values)):
                notices.append(
                    f"{file.name} folds over itself in {folded} of its pixels, where no inverse can be right"
                )
            write(inverted(device, given) if device else given)
            progress.advance()
    return tuple(notices)
