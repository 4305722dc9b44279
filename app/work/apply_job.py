"""Maps from elsewhere: pictures and clips warped by them, maps converted and inverted; all share how they are read."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Self

import numpy as np

from app.errors import UserError
from app.media import maps
from app.media.animation import Frame, animation_writer
from app.media.clip import WHOLE, rate_of
from app.media.displacement import Displacement, PixelPlaces, cropped, folds
from app.media.encoders import check_output, passes, unheld_of_clip
from app.media.files import check_kept, noticing, writable
from app.media.formats import picture_format
from app.media.inputs import MAX_PIXELS
from app.media.maps import Kind, read_map, telling_of
from app.media.numbered import check_number, check_numbers, is_sequence, numbered_files, stands_for_files
from app.media.record import Record, digest_of, digest_of_file
from app.media.source import Source, open_source
from app.model.picture import Picture
from app.progress import Progress
from app.work.export import Kept, Report, Target, noting, steps_for, write_all, writers_for
from app.work.jobs import check_result, longer_side
from app.work.layers import resample_layers
from app.work.map_sampler import MapSampler, inverted
from app.work.states import code
from app.work.tasks import Piece
from app.work.threads import prefetch
from solver.gl.device import Device
from solver.resample.plan import Edges, Quality


@dataclass(frozen=True)
class MapSource:
    """One map, or the pattern of a sequence of them, and what is in it; see `app.media.maps.read_map` for the rest."""

    path: Path
    kind: Kind | None = None
    grid: PixelPlaces | None = None
    overscan: int | None = None
    max_pixels: int = MAX_PIXELS

    @property
    def is_sequence(self) -> bool:
        return stands_for_files(self.path)

    def files(self) -> dict[int, Path]:
        """The map's file, or those of the sequence in the order of their numbers.

        Raises:
            UserError: if there is none, or one is missing among them.
        """
        if not self.is_sequence:
            return {0: self.path}
        files = numbered_files(self.path)
        check_numbers(self.path, files, range(min(files), max(files) + 1))
        return files

    def read(self, file: Path, picture: tuple[int, int] | None = None) -> Displacement:
        """One of the maps, for a picture of this size. Raises `UserError`."""
        how = {"kind": self.kind, "grid": self.grid, "overscan": self.overscan, "max_pixels": self.max_pixels}
        return read_map(file, **how, picture=picture)


@dataclass(frozen=True, kw_only=True)
class Application(Piece):
    """A picture or clip that is warped by a map.

    Attributes:
        maps: of a sequence, each map warps the frame of its number, or makes that frame of a picture's animation; where
            the frames have other numbers, they go in order. The last one stays.
        edges, filter, size, quality: as in a recipe's job.
        fps: of a picture's animation; a clip keeps its own rate.
    """

    maps: MapSource
    edges: Edges = "transparent"
    filter: Quality = "catmull-rom"
    size: int | None = None
    quality: int = 90
    fps: float = 30.0

    def located(self) -> Self:
        return replace(super().located(), maps=replace(self.maps, path=self.maps.path.absolute()))

    @property
    def _output(self) -> Path:
        assert self.outputs.file is not None
        return self.outputs.file

    def check(self) -> None:
        """Find out before the work what would keep it from being written. Raises `UserError`."""
        outputs, output = self.outputs, self._output
        check_output(output, animated=outputs.animated, codec=outputs.codec, bits=outputs.bits)
        maps.check_map(self.maps.path)
        if self.folder is None:
            writable(output)
        self.check_names([*self.maps.files().values(), *([self.picture] if self.picture else [])])
        outputs.check()

    def perform(self, device: Callable[[], Device], progress: Progress) -> Report:
        """Do it; but for the frames of a sequence, nothing is left behind if it is cancelled or fails.

        Raises:
            UserError: if a map has other proportions than the picture, or anything cannot be read or written.
        """
        self.check()
        assert self.picture is not None
        progress.enter("reading")
        source = open_source(self.picture, self.max_pixels, self.outputs.is_animation)
        check_result(self._size(source.picture), source.picture)
        self.make_folder()
        writable(self._output)
        size = self._size(source.picture)
        self.outputs.check_room(source.picture, source.clip, size, rate_of(source.clip, self.fps))
        if self.outputs.is_animation and not self.maps.is_sequence and source.clip is None:
            why = "one map and one picture do not make an animation; write a picture, such as out.png"
            raise UserError(f"Cannot write {self._output}: {why}.")
        if self.maps.is_sequence and not self.outputs.is_animation:
            raise UserError(f"Cannot write {self._output}: several maps do not make a still; write f.%04d.png or .mp4.")
        with MapSampler(device(), self.edges, self.filter, source.picture.premultiplied) as sampler:
            work = _Applying(self, source, sampler, progress)
            count = work.write_frames() if self.outputs.is_animation else work.write_still()
            work.notices.extend(sampler.notices(self.maps.path))
        return Report(count, 0, None, tuple(filter(None, work.notices)))

    def _size(self, picture: Picture) -> tuple[int, int]:
        own = picture.width, picture.height
        return own if self.size is None else longer_side(own, self.size)


class _Applying:
    """An `Application` at work on its source."""

    def __init__(self, order: Application, source: Source, sampler: MapSampler, progress: Progress) -> None:
        self.order, self.source, self.sampler, self.progress = order, source, sampler, progress
        self.outputs, self.output = order.outputs, order._output
        self.size = order._size(source.picture)
        self.notices = [source.picture.note]
        self._whole = noticing(self.output, self.notices.append)
        self._files = order.maps.files()
        self._read: tuple[Path, Displacement] | None = None

    def _map(self, file: Path) -> Displacement:
        """The map in a file, which as a rule is the one of the frame before."""
        if self._read is None or self._read[0] != file:
            picture = self.source.picture
            self._read = file, self.order.maps.read(file, (picture.width, picture.height))
        return self._read[1]

    def _sampled(self, given: Displacement, pixels: np.ndarray, target: Target) -> np.ndarray:
        """Pixels looked up through the map that was read last. Raises `UserError`, which names its file."""
        assert self._read is not None
        with telling_of(self._read[0]):
            return self.sampler.warped(given, pixels, target)

    def write_still(self) -> int:
        steps = steps_for(self.size)
        self.progress.total = 2 * steps
        given, picture = self._map(self._files[0]), self.source.picture
        losses = self.outputs.losses(with_margins=self._fits(given, picture), size=self.size)
        losses.look(picture)
        self.notices.append(losses.said)
        self.progress.enter("")
        warped = self._warped(given, picture, lambda height: self.progress.parts(steps, height), alpha=True)
        self.progress.enter("writing")
        self.outputs.write(warped, self.order.quality, self._whole)
        self.progress.count(steps)
        return 1

    def _fits(self, given: Displacement, picture: Picture) -> bool:
        """Whether what lies beyond the display window has a place in the map: in one of the same pixels only."""
        return not given.forward and self.size == (given.width, given.height) == (picture.width, picture.height)

    def _warped(
        self, given: Displacement, picture: Picture, parts: Callable[[int], Callable[[int], None]], alpha: bool
    ) -> Picture:
        """A picture with all that is written of it; for `parts` see `Progress`."""
        kind, size = picture_format(self.output), self.size
        if not self._fits(given, picture) or "wide" not in kind.keeps:
            picture = picture.cropped()
        pixels = picture.pixels
        if picture.wide is not None:
            pixels, given = picture.wide, self.sampler.widened(given, picture.margins)
            size = pixels.shape[1], pixels.shape[0]
        target = Target(size, self.sampler.how, parts(size[1]), alpha and kind.alpha)
        found = self._sampled(given, pixels, target)
        look_up, quality = partial(self._look_up, given, size), self.sampler.how.quality
        layers = resample_layers(picture.layers, look_up, quality) if "layers" in kind.keeps else ()
        if picture.wide is None:
            return replace(picture.with_pixels(found), layers=layers)
        return picture.with_wide(found, layers)

    def _look_up(self, given: Displacement, size: tuple[int, int], pixels: np.ndarray, quality: Quality) -> np.ndarray:
        """The pixels of layers; see `resample_layers`."""
        how = replace(self.sampler.how, quality=quality, premultiplied=False)
        return self._sampled(given, pixels, Target(size, how, lambda rows: self.progress.check()))

    def write_frames(self) -> int:
        order, outputs, clip, progress = self.order, self.outputs, self.source.clip, self.progress
        (first, last), is_own = outputs.part, clip is not None and clip.is_whole and is_sequence(self.output)
        if clip is not None:
            clip.check(outputs.part)
            start, count = clip.start, clip.frames
        else:
            start, count = min(self._files), len(self._files)
            if outputs.part != WHOLE:
                until = max(self._files) if last is None else last
                check_numbers(order.maps.path, self._files, range(first, until + 1))
        losses = outputs.losses(
            animated=True,
            with_layers=is_own,
            with_margins=is_own and self._fits(self._map(self._files[min(self._files)]), self.source.picture),
            clip=clip,
            size=self.size,
        )
        self.notices += [unheld_of_clip(self.output, outputs.codec, clip, self.size)] if clip else []
        first = max(first, start)
        wanted = len(range(count)[first - start : None if last is None else last + 1 - start]) if count else None
        progress.total = wanted and wanted * passes(self.output)
        progress.enter("")
        record = self._record() if is_sequence(self.output) else None
        kept = Kept([record] if record and outputs.resume else [])
        rate = rate_of(clip, order.fps)
        with ExitStack() as stack:
            pictures: Iterator[tuple[int, Picture]]
            if clip:
                if not clip.is_whole:
                    losses.look(self.source.picture)  # what belongs to all frames is with the first
                frames = clip.pictures(outputs.part, kept, progress.cancel, self.notices.append)
                read = stack.enter_context(prefetch(frames))
                pictures = ((number, losses.look(one)) for number, one in read)
            else:
                numbers = [number for number in self._files if first <= number and (last is None or number <= last)]
                losses.look(self.source.picture)
                pictures = ((number, self.source.picture) for number in numbers if not kept(number))
            writer = animation_writer(
                self.output,
                rate,
                outputs.animation(first, rate, order.quality, self.source.picture, clip),
                cancel=progress.cancel,
                passed=progress.advance,
                written=noting({self.output: record} if record else {}, self.output, self._whole),
            )
            made = ((number, self._frame(number, one, is_own)) for number, one in pictures)
            written = write_all(made, writer, writers_for(self.output, self.size), progress)
        progress.expect(-kept.count)
        self.notices += [losses.said, kept.said(written)]
        return written

    def _frame(self, number: int, picture: Picture, is_own: bool) -> Frame:
        given = self._map(self._file(number))
        if not is_own:
            target = Target(self.size, self.sampler.how, lambda rows: self.progress.check())
            return self._sampled(given, picture.pixels, target)
        frame = self._warped(given, picture, lambda height: lambda rows: self.progress.check(), alpha=False)
        return frame.stripped() if self.outputs.strip else frame

    def _file(self, number: int) -> Path:
        """The map of a frame."""
        clip, last = self.source.clip, max(self._files)
        if clip is None or (stands_for_files(clip.path) and clip.start in self._files):
            return self._files[min(number, last)]
        return self._files[min(min(self._files) + number - clip.start, last)]

    def _record(self) -> Record:
        """What is known of the files of the sequence that is written."""
        order, outputs, clip = self.order, self.outputs, self.source.clip
        how = order.edges, order.filter, order.size, order.quality, outputs.bits, outputs.strip, outputs.codec
        common = digest_of(code(), how, replace(order.maps, path=Path()), self.source.picture)
        digest = cache(digest_of_file)

        def made_of(number: int) -> str:
            return digest_of(common, number, digest(self._file(number)), clip.digest(number) if clip else "")

        return Record(self.output, made_of)


def converted(source: MapSource, output: Path, kind: Kind, invert: bool, progress: Progress) -> tuple[str, ...]:
    """Write a map, or a sequence of maps, in another format, whole or not at all. Says what the user should hear of.

    Raises:
        UserError: if one cannot be read or written.
    """
    maps.check_map(output)
    check_number(output)
    writable(output)
    files = source.files()
    check_kept(source.path, output)
    progress.total = len(files)
    if is_sequence(output) != source.is_sequence:
        raise UserError(f"{source.path} and {output} must both be sequences, or neither")
    notices = []
    one = nullcontext(lambda given, number: maps.write_map(output, given, kind))
    with ExitStack() as stack:
        device = stack.enter_context(Device.headless()) if invert else None
        write = stack.enter_context(
            maps.map_writer(output, kind, cancel=progress.cancel) if source.is_sequence else one
        )
        for number, file in files.items():
            given = source.read(file)
            if device and (folded := folds(cropped(given).values)):
                notices.append(f"{file.name} folds over itself in {folded} of its pixels, where it has no inverse")
            with telling_of(file):
                turned = inverted(device, given) if device else given
            write(turned, number)
            progress.advance()
    return tuple(notices)
