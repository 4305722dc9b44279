"""A recipe made into files: a picture, an animation, a clip warped, maps; streamed frame by frame.

One long class: what a job simulates, looks up and writes must go in one order.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from functools import partial
from itertools import groupby, pairwise
from math import ceil
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from app.errors import UserError
from app.media.animation import Frame, FrameWriter, NumberedWriter, animation_writer, frame_order, reordered
from app.media.auxiliary import Pictures
from app.media.clip import frame_of
from app.media.depth import mixed
from app.media.displacement import Displacement
from app.media.encoders import passes, unheld_of_clip
from app.media.files import noticing, replacing, telling
from app.media.formats import picture_format
from app.media.holding import Losses
from app.media.maps import map_writer, write_map
from app.media.numbered import is_sequence
from app.media.record import Record, digest_of
from app.model.picture import Picture, opaque_value
from app.model.recipe import Recipe
from app.model.timeline import Dissolve, Sentinel, Timeline, dissolved, frame_positions
from app.progress import Progress
from app.work.checkpoints import DEFAULT_BUDGET
from app.work.handle_status import ANEW, near_enough, unmet
from app.work.jobs import Job, MapOutput, longer_side, result_size
from app.work.layers import resample_layers, widened
from app.work.observation import observe
from app.work.replay import Replay
from app.work.states import StoredStates, code
from app.work.threads import prefetch, write_behind
from solver.gl.device import Device
from solver.resample.plan import GivenMap, Map, Quality, Sampling, SamplingError
from solver.resample.sampler import Sampler
from solver.warp.inverse import ForwardMap

T = TypeVar("T")
Numbered = tuple[int, Frame]
TakeMap = Callable[[tuple[int, Displacement]], None]

POINTS_AT_ONCE = 1_000_000  # of a map
MOST_WRITERS = 4  # threads that encode files of a sequence; each holds a frame more in memory
PIXELS_WRITTEN = 2**26  # at a time, of these files together
PIXELS_A_STEP = 100_000  # whose look-up, or writing as PNG, takes about as long on a CPU as a step on 256 cells


@dataclass(frozen=True)
class Report:
    """How a job went.

    Attributes:
        frames: written.
        ticks: simulated.
        verdict: which stop condition ended the simulation and when, or None.
        notices: what the user should hear of.
    """

    frames: int
    ticks: int
    verdict: str | None
    notices: tuple[str, ...]


def run(device: Device, job: Job, progress: Progress) -> Report:
    """Do the job, which has been checked; nothing of it is left behind if it is cancelled or fails.

    Raises:
        UserError: what is wrong with the recipe, the picture or the output.
        Cancelled: if `progress` says so.
    """
    export = _Export(device, job, progress)
    try:
        return export.run()
    finally:
        export.release()


class _Export:
    def __init__(self, device: Device, job: Job, progress: Progress) -> None:
        self.job = job
        self.outputs = job.outputs
        self.recipe = job.recipe
        self.progress = progress
        self.device = device
        self.pictures = Pictures(job.picture, job.folder, job.frame[0] if job.frame else job.clip, job.named_by)
        job.picture.pixels.flags.writeable = False  # so that it stays on the GPU from frame to frame
        playback = job.recipe.time
        # A moving source has no frame that is shown twice: what goes back does so in the simulation.
        self.is_spooled = job.clip is None and not (self.outputs.maps and self.outputs.maps.is_sequence)
        goes_back = (playback.reverse or playback.ping_pong) and not self.is_spooled
        self.replay = Replay(device, job.recipe, self.pictures, budget=DEFAULT_BUDGET if goes_back else 0)
        states = job.outputs.states
        self.states = StoredStates(states, self.replay, self.pictures.notice) if states else None
        self.sampler = Sampler(device)
        self.size = result_size(job.recipe, job.picture)
        # What the results belong to; densities are straight, whatever the picture is.
        like = job.picture if job.frame is None else frame_of(*job.frame)
        self.like = replace(like, premultiplied=False) if job.recipe.mode == "density" else like
        self.written: list[Path] = []
        self.whole = {path: noticing(path, self.pictures.notice) for path in self.outputs.files}
        self.sentinel = Sentinel(job.recipe.stop, job.recipe.fluid.dt)
        self.losses = self._losses() if self.outputs.file is not None else None
        self.numbers: list[dict[str, Any]] = []
        self.dissolves: dict[int, Dissolve] = {}
        self._position: Fraction | None = None
        self._last_shown = Fraction(0)  # where the handles shall have arrived
        self._has_warned = False
        device.timings.enabled = self.replay.fluid.measuring = self.outputs.stats is not None

    def release(self) -> None:
        self.device.timings.enabled = False
        self.sampler.release()
        self.replay.release()

    def run(self) -> Report:
        with telling(self.written):
            return self._run()

    def _run(self) -> Report:
        recipe, job, outputs = self.recipe, self.job, self.outputs
        watched = not self.sentinel.is_idle
        runs, stills = 2 if watched and outputs.has_frames else 1, self._steps_for_stills()
        self.progress.total = runs * recipe.ticks + stills
        verdict = self._run_until_stopped() if watched else None
        end = self.replay.tick if watched else recipe.ticks
        self.progress.total = runs * end + stills
        if outputs.has_frames:
            shown, self.dissolves = shown_positions(Timeline(end, recipe.fluid.dt), recipe, float(job.rate))
            count = self._write_frames(shown, end)
            maps = outputs.maps.path if outputs.maps and outputs.maps.is_sequence else None
            self.written += [path for path in (outputs.file, maps) if path is not None]
        else:
            self._go_to(Fraction(end))
            if outputs.file is not None:
                steps = steps_for(self.size)
                self._look(self.like)
                picture = self._still(self.like, lambda height: self.progress.parts(steps, height))
                self.progress.enter("writing")
                outputs.write(picture, recipe.output.quality, self.whole[outputs.file])
                self.written.append(outputs.file)
                self.progress.count(steps)
            self._note(0, Fraction(end))
            count = 1
        if outputs.maps is not None and not outputs.maps.is_sequence:
            self.progress.enter("making the map")
            try:
                found = self._map(outputs.maps)
            except MemoryError:
                width, height = (side + 2 * outputs.maps.overscan for side in self._map_size(outputs.maps))
                little = f"there is not enough memory for a map of {width} x {height} pixels"
                raise UserError(
                    f"{little}; lower --map-size or --overscan", in_window=f"{little}; choose a smaller size"
                ) from None
            self.progress.advance(steps_for((found.width, found.height)))
            self.progress.enter("writing the map")
            write_map(outputs.maps.path, found, outputs.maps.kind, self.whole[outputs.maps.path])
            self.written.append(outputs.maps.path)
            self.progress.count(steps_for((found.width, found.height)))
        if outputs.stats is not None:
            with replacing(outputs.stats, whole=self.whole[outputs.stats]) as temporary:
                temporary.write_text(json.dumps(self._document(verdict), indent=1) + "\n", "utf-8")
        if self.states is not None:
            self.states.keep(last=True)  # where the next part begins
        self._note_losses()
        return Report(count, end, verdict, tuple(self.pictures.notices))

    def _note_losses(self) -> None:
        """What the user should know of the last warp, and of what the output cannot hold."""
        every = self.replay.warp.size
        if self.recipe.mode == "coordinates" and (distortion := self.replay.seen.statistics(every)).folds:
            said = f"the warp folds over itself in {distortion.folds} of {distortion.places} places"
            amount = self.recipe.amount
            only_here = amount != 1 and not self.replay.warp.statistics(every).folds
            self.pictures.notice(f"{said} at an amount of {amount:g}, and in none at 1" if only_here else said)
        # Behind the last frame, as where that was kept or is not the latest, they are still on their way.
        missed = list(unmet(self.replay, near_enough(self.replay))) if self.replay.tick >= int(self._last_shown) else []
        for each in missed:
            self.pictures.notice(each.said)
        if any(each.helped for each in missed):
            self.pictures.notice(ANEW)
        output, clip = self.outputs.file, self.job.clip
        if self.losses is not None and (said := self.losses.said):
            self.pictures.notice(said)
        if clip is not None and output and (said := unheld_of_clip(output, self.outputs.codec, clip, self.size)):
            self.pictures.notice(said)

    def _steps_for_stills(self) -> int:
        """What the last picture and the last map count as, looked up and written."""
        file, maps = self.outputs.file, self.outputs.maps
        sizes = [self.size] if file is not None and not self.outputs.has_frames else []
        sizes += [self._map_size(maps)] if maps is not None and not maps.is_sequence else []
        return sum(2 * steps_for(size) for size in sizes)

    def _run_until_stopped(self) -> str | None:
        """Simulate until a stop condition fires, or to the end; says which fired."""
        self._warn()
        for _ in range(self.recipe.ticks):
            self._advance()
            if verdict := self.sentinel.verdict(self.replay.tick, observe(self.replay, self.sentinel)):
                return verdict
        return None

    # -- frames -----------------------------------------------------------------------------------------------------

    def _write_frames(self, shown: list[Fraction], end: int) -> int:
        """Write the frames, each warped by the map at its position in `shown`; says how many there were."""
        job, file, maps, (first, last) = self.job, self.outputs.file, self.outputs.maps, self.outputs.part
        clip, start = job.clip, job.clip.start if job.clip else 0
        if clip is None and first >= len(shown):
            raise UserError(f"the animation has the frames 0-{len(shown) - 1}, and none from {first} on")
        first = max(first, start)
        until = None if last is None else last + 1 - start
        moment = clip.moment if clip else lambda number: number
        wanted = shown[moment(first) : None if last is None else moment(last) + 1]
        self.progress.expect(ceil(max(wanted, default=shown[-1])) - end)
        count = len(range(clip.frames or len(shown))[first - start : until]) if clip else len(wanted)
        records = self._records()
        passed, threads, writer = 1, 0, None
        if file is not None:
            passed, threads = passes(file), writers_for(file, self.size)
            writer = self._writer(file, first, records)
        self.progress.expect(count * passed)
        with ExitStack() as stack:
            take_map = None
            if maps is not None and maps.is_sequence:
                cancel, note = self.progress.cancel, noting(records, maps.path, self.whole[maps.path])
                maker = map_writer(maps.path, maps.kind, cancel=cancel, written=note, resumed=self.outputs.resume)
                makers = writers_for(maps.path, self._map_size(maps))
                take_map = stack.enter_context(numbered_behind(stack.enter_context(maker), makers))
            kept = Kept(records.values() if self.outputs.resume else [])
            if clip is not None:
                if not clip.is_whole:
                    self._look(job.picture)  # what belongs to all frames is with the first
                pictures = clip.pictures(self.outputs.part, kept, self.progress.cancel, self.pictures.notice)
                source = stack.enter_context(prefetch(pictures))
                # Once the fluid has come to its end, the clip goes on with the last warp.
                at = ((number, shown[min(moment(number), len(shown) - 1)], self._look(one)) for number, one in source)
                frames = self._frames(at, take_map)
            else:
                self._look(job.picture)
                missing = [(number, position) for number, position in enumerate(wanted, first) if not kept(number)]
                frames = self._frames_of_picture(missing, take_map)
            written = write_all(frames, writer, threads, self.progress)
            self.progress.expect(-kept.count)
            if said := kept.said(written):
                self.pictures.notice(said)
        self._last_shown = max(wanted, default=shown[-1])
        if maps is not None and not maps.is_sequence:
            self._go_to(self._last_shown)
        return written

    def _records(self) -> dict[Path, Record]:
        """What is known of the files of each sequence that is written."""
        outputs, maps = self.outputs, self.outputs.maps
        written: dict[Path, tuple[Any, ...]] = {}
        if outputs.file is not None and is_sequence(outputs.file):
            written[outputs.file] = "picture", outputs.bits, outputs.strip, outputs.codec
        if maps is not None and maps.is_sequence:
            written[maps.path] = "map", replace(maps, path=Path())
        if not written or not outputs.recorded:
            return {}
        clip, recipe = self.job.clip, self.recipe.model_dump_json(exclude={"name", "picture"})
        common = digest_of(code(), recipe, self.job.picture, *self.pictures.values(self.recipe))

        def made_of(how: tuple[Any, ...], number: int) -> str:
            return digest_of(common, how, number, clip.digest(number) if clip else "")

        return {path: Record(path, partial(made_of, how)) for path, how in written.items()}

    def _frames_of_picture(self, wanted: list[tuple[int, Fraction]], take_map: TakeMap | None) -> Iterator[Numbered]:
        """The picture warped by the maps at these positions; one that is shown again is not made again."""
        picture = self.job.picture
        if not self.is_spooled or self.outputs.file is None:
            return self._frames(((number, position, picture) for number, position in wanted), take_map)
        # What is dissolved is looked up at two positions, the one after the other.
        looked: list[tuple[int, Fraction]] = []
        for number, position in wanted:
            into = self.dissolves.get(number)
            looked += [(number, position), *([(number, into.into)] if into else [])]
        numbers: dict[Fraction, int] = {}
        for number, position in looked:
            numbers.setdefault(position, number)
        distinct = sorted(numbers)
        places = {position: place for place, position in enumerate(distinct)}
        order = [places[position] for _, position in looked]
        numbered = self._frames(((numbers[at], at, picture) for at in distinct), take_map)
        made = (frame for _, frame in numbered if isinstance(frame, np.ndarray))
        goes_back = any(later < earlier for earlier, later in pairwise(order))
        frames = reordered(made, order, self.outputs.file.parent) if goes_back else repeated(made, order)
        return ((number, self._dissolved(number, frames)) for number, _ in wanted)

    def _dissolved(self, number: int, frames: Iterator[np.ndarray]) -> np.ndarray:
        """The next of the frames, dissolved into the one after it if this number is to be."""
        frame, into = next(frames), self.dissolves.get(number)
        if into is None:
            return frame
        return mixed(frame, next(frames), into.share, premultiplied=self.like.premultiplied)

    def _writer(self, file: Path, first: int, records: dict[Path, Record]) -> AbstractContextManager[FrameWriter]:
        job = self.job
        return animation_writer(
            file,
            job.rate,
            self.outputs.animation(first, job.rate, self.recipe.output.quality, self.like, job.clip),
            cancel=self.progress.cancel,
            passed=self.progress.advance,
            written=noting(records, file, self.whole[file]),
        )

    def _frames(
        self, positions: Iterable[tuple[int, Fraction, Picture]], take_map: TakeMap | None
    ) -> Iterator[Numbered]:
        """The pictures, each warped by the map at its position, with their numbers."""
        nothing = np.empty((0, 0, 1), np.uint8)
        for number, position, picture in positions:
            self._go_to(position)
            if take_map is not None and self.outputs.maps is not None:
                take_map((number, self._map(self.outputs.maps)))
            frame = self._frame_of(picture) if self.outputs.file is not None else nothing
            self._note(number, position)
            yield number, frame

    def _frame_of(self, picture: Picture) -> Frame:
        if not self._has_own:
            return self._frame(picture)
        frame = self._still(picture, lambda height: lambda rows: self.progress.check())
        return frame.stripped() if self.outputs.strip else frame

    def _go_to(self, position: Fraction) -> None:
        if position == self._position:
            return
        whole = position // 1
        begins = self._position is None or whole < self.replay.tick
        self.replay.head_for(int(whole))
        before = self.replay.tick
        if self.states is not None and begins and self.states.resume(whole):
            self.progress.advance(self.replay.tick - before)
        if self.replay.tick < position:
            self._warn()
        while self.replay.tick < whole:
            self._advance()
        self.replay.seek(position)
        self._position = position

    def _frame(self, picture: Picture, on_rows: Callable[[int], None] | None = None) -> np.ndarray:
        """The pixels warped by the map as it is; for `on_rows` see `Target`."""
        on_rows = on_rows or (lambda rows: self.progress.check())
        if self.replay.density is not None:
            frame = self._density_frame(self.replay.density.get())
            on_rows(len(frame))
            return frame
        # The frames of an animation are all of one kind, and most of its formats have no alpha.
        file = self.outputs.file
        alpha = not self.outputs.is_animation and file is not None and picture_format(file).alpha
        with self.device.stage("sample picture"):
            how = replace(self._how, premultiplied=picture.premultiplied)
            try:
                target = Target(self.size, how, on_rows, alpha)
                return looked_up(self.sampler, self.replay.seen, picture.pixels, target)
            except SamplingError as error:
                raise self._unusable(error) from None

    def _unusable(self, error: SamplingError) -> UserError:
        """Why the map as it is cannot be looked up, by the name of the one that the recipe begins with."""
        return UserError(f"{self.recipe.map or 'The warp'} cannot be applied: {error}; use a smaller picture.")

    @property
    def _how(self) -> Sampling:
        output = self.recipe.output
        return Sampling(output.filter, self.recipe.edges, output.samples)

    @property
    def _has_own(self) -> bool:
        """Whether each frame is a file made from one, with all that belongs to it."""
        file, clip = self.outputs.file, self.job.clip
        return file is not None and is_sequence(file) and clip is not None and clip.is_whole

    @property
    def _has_layers(self) -> bool:
        """Whether layers are warped along: of what is written as it is read, where its own pixels are moved."""
        is_whole = self.outputs.file is not None and (self._has_own or not self.outputs.has_frames)
        return is_whole and self.recipe.mode != "density"

    @property
    def _has_margins(self) -> bool:
        """Whether what lies beyond the picture's display window is warped along: where they are of the same size."""
        return self._has_layers and self.size == (self.job.picture.width, self.job.picture.height)

    def _losses(self) -> Losses:
        animated, clip = self.outputs.has_frames, self.job.clip if self.outputs.has_frames else None
        how = {"with_layers": self._has_layers, "with_margins": self._has_margins, "size": self.size}
        return self.outputs.losses(animated=animated, clip=clip, **how)

    def _look(self, picture: Picture) -> Picture:
        """See what of a picture the output does not hold, if there is one."""
        return picture if self.losses is None else self.losses.look(picture)

    def _still(self, picture: Picture, parts: Callable[[int], Callable[[int], None]]) -> Picture:
        """A picture warped by the map as it is, with all that is written of it; for `parts` see `Progress`."""
        output = self.outputs.file
        assert output is not None
        keeps = picture_format(output).keeps
        if picture.wide is None or not self._has_margins or "wide" not in keeps:
            still = picture.with_pixels(self._frame(picture, parts(self.size[1])))
            if not self._has_layers or "layers" not in keeps:
                return still
            layers = picture.cropped().layers
            return replace(
                still,
                layers=resample_layers(layers, partial(self._look_up, self.replay.seen, self.size), self._how.quality),
            )
        given = displacement(self.replay, self.size, 0, False, self.progress.check)
        warp = GivenMap(self.device, widened(given, picture.margins))
        try:
            height, width = picture.wide.shape[:2]
            how = replace(self._how, premultiplied=picture.premultiplied)
            target = Target((width, height), how, parts(height), alpha=not self.outputs.is_animation)
            wide = looked_up(self.sampler, warp, picture.wide, target)
            return picture.with_wide(
                wide, resample_layers(picture.layers, partial(self._look_up, warp, target.size), how.quality)
            )
        except SamplingError as error:
            raise self._unusable(error) from None
        finally:
            warp.release()

    def _look_up(self, warp: Map, size: tuple[int, int], pixels: np.ndarray, quality: Quality) -> np.ndarray:
        """The pixels of layers; see `resample_layers`."""
        target = Target(size, replace(self._how, quality=quality), lambda rows: self.progress.check())
        return looked_up(self.sampler, warp, pixels, target)

    def _density_frame(self, values: np.ndarray) -> np.ndarray:
        """The densities as 8-bit colours, in the result's size."""
        channels = 4 if self.job.picture.has_alpha else 3
        pixels = (np.clip(values[..., :channels], 0, 1) * 255 + 0.5).astype(np.uint8)
        if self.size == pixels.shape[1::-1]:
            return pixels
        still = GivenMap(self.device, np.zeros((8, 8, 2), np.float32))
        try:
            return self.sampler.apply(still, pixels, self.size)
        finally:
            still.release()

    def _map(self, wanted: MapOutput) -> Displacement:
        return displacement(self.replay, self._map_size(wanted), wanted.overscan, wanted.forward, self.progress.check)

    def _map_size(self, wanted: MapOutput) -> tuple[int, int]:
        return self.size if wanted.size is None else longer_side(self.size, wanted.size)

    def _warn(self) -> None:
        """Before the first step that is simulated: where all frames are kept, there is none that could take long."""
        if not self._has_warned and (said := self.job.too_fine):
            (self.progress.warn or self.pictures.notice)(said)
        self._has_warned = True

    def _advance(self) -> None:
        self.replay.advance()
        if self.states is not None:
            self.states.keep()
        self.progress.advance()

    # -- numbers ----------------------------------------------------------------------------------------------------

    def _note(self, number: int, position: Fraction) -> None:
        """Keep the numbers about a frame, if they are asked for."""
        if self.outputs.stats is None:
            return
        replay, residuals = self.replay, self.replay.fluid.residuals
        told = {
            "frame": number,
            "tick": float(position),
            "time": float(position) * self.recipe.fluid.dt,
            **asdict(residuals),
            "divergence_left": residuals.divergence_left,
            **asdict(replay.fluid.motion()),
            **asdict(replay.warp.statistics()),
            "milliseconds": {stage: round(spent, 3) for stage, spent in self.device.timings.take().items()},
        }
        self.numbers.append(told)

    def _document(self, verdict: str | None) -> dict[str, Any]:
        return {
            "fluidwarp": 1,
            "opengl": self.device.limits.renderer,
            "picture": [self.job.picture.width, self.job.picture.height],
            "result": list(self.size),
            "grid": list(self.replay.grid.size),
            "dt": self.recipe.fluid.dt,
            "solver": self.recipe.fluid.solver,
            "stopped": verdict,
            "frames": self.numbers,
        }


def noting(records: dict[Path, Record], path: Path, whole: Callable[[Path], None]) -> Callable[[int, Path], None]:
    """What hears of each file of an animation: the record of its sequence, if it has one, or `whole`."""
    return records[path].add if path in records else lambda number, file: whole(file)


class Kept:
    """Which frames need not be made again, as the records of all their files hold them; how many were asked for."""

    def __init__(self, records: Collection[Record]) -> None:
        self.count = 0
        self._records = records

    def __call__(self, number: int) -> bool:
        is_kept = bool(self._records) and all(record.holds(number) for record in self._records)
        self.count += is_kept
        return is_kept

    def said(self, written: int) -> str:
        """How many were kept, in a sentence; "" if none was."""
        return f"{self.count} of {self.count + written} frames were whole and are kept" if self.count else ""


def writers_for(path: Path, size: tuple[int, int]) -> int:
    """How many threads write pictures of this size to `path`: several, if it is a sequence and they fit in memory."""
    if not is_sequence(path):
        return 1
    return max(1, min(os.cpu_count() or 1, MOST_WRITERS, PIXELS_WRITTEN // (size[0] * size[1])))


def numbered_behind(write: NumberedWriter[T], threads: int) -> AbstractContextManager[Callable[[tuple[int, T]], None]]:
    """`write`, in so many threads of its own; see `write_behind`."""
    return write_behind(lambda item: write(item[1], item[0]), threads)


def write_all(
    frames: Iterable[Numbered],
    writer: AbstractContextManager[FrameWriter] | None,
    threads: int,
    progress: Progress,
) -> int:
    """Write the numbered frames of an animation, each while the next one is made; says how many there were.

    Args:
        writer: None if they are made for something else.
        threads: that write.
    """
    count = 0
    with ExitStack() as stack:
        write = stack.enter_context(numbered_behind(stack.enter_context(writer), threads)) if writer else None
        for frame in frames:
            if write is not None:
                write(frame)
            count += 1
            progress.advance()
        progress.enter("writing")  # what the encoder still holds, and what it does with all frames
    return count


def repeated(frames: Iterator[np.ndarray], order: list[int]) -> Iterator[np.ndarray]:
    """Frames (h, w, c) in an `order` that never goes back, each as often as it is in it."""
    for frame, (_, repeats) in zip(frames, groupby(order), strict=True):
        for _ in repeats:
            yield frame


def shown_positions(timeline: Timeline, recipe: Recipe, fps: float) -> tuple[list[Fraction], dict[int, Dissolve]]:
    """The position in ticks of every frame of an animation in the order they are shown, and which are dissolved."""
    playback = recipe.time
    positions = frame_positions(timeline, playback, fps)
    if playback.reverse:
        positions.reverse()
    if playback.dissolve:
        return dissolved(positions, round(playback.dissolve * fps))
    order = frame_order(
        len(positions),
        ping_pong=playback.ping_pong,
        hold_first=round(playback.hold_first * fps),
        hold_last=round(playback.hold_last * fps),
    )
    return [positions[index] for index in order], {}


def displacement(
    replay: Replay,
    size: tuple[int, int],
    overscan: int = 0,
    forward: bool = False,
    check: Callable[[], None] = lambda: None,
) -> Displacement:
    """The warp map at this moment, for a picture of `size` with `overscan` pixels more on every side.

    Nothing flows beyond the picture's edge: the displacement there is that of the nearest point on it.

    Args:
        forward: where the points of the original go.
        check: called now and then; may raise, as `Progress.check` does.
    """
    # A size in whole pixels has nearly the picture's aspect.
    fit = np.divide(size, max(size)) / replay.grid.extent
    with ForwardMap(replay.seen) if forward else nullcontext(replay.seen) as warp:
        if not overscan and max(size) <= replay.device.limits.max_texture_size:
            return Displacement((warp.read(size) * fit).astype(np.float32), 0, forward)
        (width, height), (right, bottom) = size, replay.grid.extent
        x = np.clip((np.arange(-overscan, width + overscan) + 0.5) / width, 0, 1) * right
        y = np.clip((np.arange(-overscan, height + overscan) + 0.5) / height, 0, 1) * bottom
        values = np.empty((len(y), len(x), 2), np.float32)
        rows = max(1, POINTS_AT_ONCE // len(x))
        for top in range(0, len(y), rows):
            check()
            points = np.stack(np.meshgrid(x, y[top : top + rows]), axis=-1).reshape(-1, 2)
            values[top : top + rows] = (warp.at(points) * fit).reshape(-1, len(x), 2)
        return Displacement(values, overscan, forward)


@dataclass(frozen=True)
class Target:
    """What pixels that are looked up become.

    Attributes:
        size: (width, height).
        on_rows: called with the number of rows in every band; may raise, as `Progress.check` does.
        alpha: opaque pixels get an alpha channel if the map reaches beyond them, and `how.edges` wants that to be seen.
    """

    size: tuple[int, int]
    how: Sampling
    on_rows: Callable[[int], None]
    alpha: bool = False


def looked_up(sampler: Sampler, warp: Map, pixels: np.ndarray, target: Target) -> np.ndarray:
    """The pixels (h, w, c) looked up through a map, in bands, so that little more than the result is in memory."""
    size, how = target.size, target.how
    result = np.empty((size[1], size[0], pixels.shape[2]), pixels.dtype)
    if not target.alpha or pixels.shape[2] in (2, 4) or how.edges != "transparent":
        for band in sampler.bands(warp, pixels, size, how, result):
            target.on_rows(len(band))
        return result
    top = 0
    for band in sampler.bands(warp, with_alpha(pixels), size, how):
        target.on_rows(len(band))
        if result.shape[2] == pixels.shape[2] and (band[..., -1] < opaque_value(band)).any():
            result = with_alpha(result)
        result[top : top + len(band)] = band[..., : result.shape[2]]
        top += len(band)
    return result


def steps_for(size: tuple[int, int]) -> int:
    """How many steps of a job looking up a still of this size counts as; writing it counts as many again."""
    return max(1, size[0] * size[1] // PIXELS_A_STEP)


def with_alpha(pixels: np.ndarray) -> np.ndarray:
    """(h, w, 1-4) with an alpha channel: opaque where there was none."""
    if pixels.shape[2] in (2, 4):
        return pixels
    return np.concatenate([pixels, np.full_like(pixels[..., :1], opaque_value(pixels))], axis=2)
