"""A recipe made into files: a picture, an animation or a sequence, streamed frame by frame."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from fractions import Fraction
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from app.animation import animation_writer, check_animation, frame_order, is_animation, reordered
from app.errors import UserError
from app.files import replacing, writable
from app.maps import Displacement, check_map, cropped, write_map
from app.opening import check_picture
from app.pictures import Picture, picture_format, write_picture
from app.progress import Progress
from app.recipe import Recipe
from app.replay import Replay
from app.sampling import Pictures
from app.timeline import Sentinel, Timeline, frame_positions
from solver.context import Device
from solver.sampling import GivenMap, Sampler, Sampling


@dataclass(frozen=True)
class Job:
    """What is made of what.

    Attributes:
        recipe: all settings; its [output] says the size and the rate.
        picture: the source.
        folder: where the names of auxiliary pictures in the recipe start from.
        output: the file, or the pattern of a sequence's files.
        stats: a JSON file for numbers about every frame.
        map: a file for the last frame's warp map; see `app.maps`.
    """

    recipe: Recipe
    picture: Picture
    folder: Path
    output: Path
    stats: Path | None = None
    map: Path | None = None

    @property
    def is_animation(self) -> bool:
        return is_animation(self.output)

    def check(self) -> None:
        """Find out before the work what would keep it from being written.

        Raises:
            UserError: naming the file and the mend.
        """
        if self.is_animation:
            check_animation(self.output, self.recipe.output.fps)
        else:
            picture_format(self.output)
        if self.map is not None:
            check_map(self.map)
        for path in (self.output, self.stats, self.map):
            if path is not None:
                writable(path)


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
    """Do the job; nothing of it is left behind if it is cancelled or fails.

    Raises:
        UserError: what is wrong with the recipe, the picture or the output.
        Cancelled: if `progress` says so.
    """
    job.check()
    export = _Export(device, job, progress)
    try:
        return export.run()
    finally:
        export.release()


class _Export:
    def __init__(self, device: Device, job: Job, progress: Progress) -> None:
        check_picture(job.picture, job.recipe.fluid.grid)
        self.job = job
        self.recipe = job.recipe
        self.progress = progress
        self.device = device
        self.pictures = Pictures(job.picture, job.folder)
        # Nothing goes back in time here, so that no checkpoint is needed.
        self.replay = Replay(device, job.recipe, self.pictures, budget=0)
        self.sampler = Sampler(device)
        self.size = result_size(job.recipe, job.picture)
        self.sentinel = Sentinel(job.recipe.stop, job.recipe.fluid.dt)
        self.numbers: list[dict[str, Any]] = []
        device.timings.enabled = self.replay.fluid.measuring = job.stats is not None

    def release(self) -> None:
        self.device.timings.enabled = False
        self.sampler.release()
        self.replay.release()

    def run(self) -> Report:
        recipe, job = self.recipe, self.job
        watched = not self.sentinel.is_idle
        self.progress.total = recipe.ticks * (2 if watched and job.is_animation else 1)
        verdict = self._run_until_stopped() if watched else None
        end = self.replay.tick if watched else recipe.ticks
        if job.is_animation:
            positions = frame_positions(Timeline(end, recipe.fluid.dt), recipe.time, recipe.output.fps)
            count = self._write_animation(positions)
        else:
            picture = next(self._frames([Fraction(end)]))
            write_picture(job.output, job.picture.with_pixels(picture), quality=recipe.output.quality)
            count = 1
        if job.map is not None:
            write_map(job.map, displacement(self.replay, self.size))
        if job.stats is not None:
            with replacing(job.stats) as temporary:
                temporary.write_text(json.dumps(self._document(verdict), indent=1) + "\n", "utf-8")
        return Report(count, end, verdict, tuple(self.pictures.notices))

    def _run_until_stopped(self) -> str | None:
        """Simulate until a stop condition fires, or to the end; says which fired."""
        for _ in range(self.recipe.ticks):
            self._advance()
            if verdict := self.sentinel.verdict(self.replay.tick, self.replay.observe(self.sentinel)):
                return verdict
        return None

    def _write_animation(self, positions: list[Fraction]) -> int:
        playback, output = self.recipe.time, self.recipe.output
        order = list(
            frame_order(
                len(positions),
                ping_pong=playback.ping_pong,
                hold_first=round(playback.hold_first * output.fps),
                hold_last=round(playback.hold_last * output.fps),
            )
        )
        if playback.reverse:
            order = [len(positions) - 1 - index for index in order]
        with ExitStack() as stack:
            write = stack.enter_context(
                animation_writer(
                    self.job.output,
                    Fraction(output.fps).limit_denominator(1001),
                    crf=round(45 - 0.3 * output.quality),
                    frames=len(order),
                    like=self.job.picture,
                    cancel=self.progress.cancel,
                )
            )
            frames = self._frames(positions)
            # Only what goes back needs frames that are past, which are kept on the disk.
            goes_back = playback.reverse or playback.ping_pong
            for frame in reordered(frames, order, self.job.output.parent) if goes_back else held(frames, order):
                write(frame)
        return len(order)

    def _frames(self, positions: list[Fraction]) -> Iterator[np.ndarray]:
        """The warped picture at each position, (h, w, c) like the source."""
        for position in positions:
            if position < self.replay.tick:
                self.replay.seek(0)
            while self.replay.tick < position // 1:
                self._advance()
            self.replay.seek(position)
            with self.device.stage("sample picture"):
                frame = self._frame()
            if self.job.stats is not None:
                self.numbers.append(self._numbers(position))
            yield frame

    def _frame(self) -> np.ndarray:
        if self.replay.density is not None:
            return self._density_frame(self.replay.density.get())
        how = Sampling(edges=self.recipe.edges)
        pixels = self.job.picture.pixels
        if self.job.is_animation or self.recipe.edges != "transparent" or not picture_format(self.job.output).alpha:
            return self.sampler.apply(self.replay.warp, pixels, self.size, how)
        # What lies beyond the edge is to be transparent, if anything does.
        warped = self.sampler.apply(self.replay.warp, with_alpha(pixels), self.size, how)
        if self.job.picture.has_alpha or (warped[..., -1] < opaque_value(warped)).any():
            return warped
        return np.ascontiguousarray(warped[..., :-1])

    def _density_frame(self, values: np.ndarray) -> np.ndarray:
        """The densities as 8-bit colours, in the result's size."""
        channels = 4 if self.job.picture.has_alpha else 3
        pixels = (np.clip(values[..., :channels], 0, 1) * 255 + 0.5).astype(np.uint8)
        if self.size == pixels.shape[1::-1]:
            return pixels
        return self.sampler.apply(GivenMap(self.device, np.zeros((8, 8, 2))), pixels, self.size)

    def _advance(self) -> None:
        self.replay.advance()
        self.progress.advance()

    # -- numbers ----------------------------------------------------------------------------------------------------

    def _numbers(self, position: Fraction) -> dict[str, Any]:
        replay, residuals = self.replay, self.replay.fluid.residuals
        return {
            "frame": len(self.numbers),
            "tick": float(position),
            "time": float(position) * self.recipe.fluid.dt,
            **asdict(residuals),
            "divergence_left": residuals.divergence_left,
            **asdict(replay.fluid.motion()),
            **asdict(replay.warp.statistics()),
            "milliseconds": {stage: round(spent, 3) for stage, spent in self.device.timings.take().items()},
        }

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


def held(frames: Iterator[np.ndarray], order: list[int]) -> Iterator[np.ndarray]:
    """Frames in an `order` that never goes back, each as often as it is in it."""
    for frame, (_, repeats) in zip(frames, groupby(order), strict=True):
        for _ in repeats:
            yield frame


def displacement(replay: Replay, size: tuple[int, int]) -> Displacement:
    """The warp map at this moment, for a picture of `size`."""
    # The grid's cells are square, and its sides whole cells: the picture is fitted to it by less than half a cell.
    fit = np.divide(size, max(size)) / replay.grid.extent
    return Displacement((replay.warp.read(size) * fit).astype(np.float32))


def apply_map(device: Device, given: Displacement, picture: Picture, recipe: Recipe) -> Picture:
    """The picture looked up through a map that was made before; edges and size as the recipe says.

    Raises:
        UserError: if the map has other proportions than the picture.
    """
    if given.forward:
        raise UserError("this map tells where each point goes; to warp a picture, one of where it comes from is needed")
    values = cropped(given.fitted(picture.width, picture.height)).values
    sampler = Sampler(device)
    try:
        size, how = result_size(recipe, picture), Sampling(edges=recipe.edges)
        pixels = sampler.apply(GivenMap(device, values), picture.pixels, size, how)
    finally:
        sampler.release()
    return picture.with_pixels(pixels)


def result_size(recipe: Recipe, picture: Picture) -> tuple[int, int]:
    """(width, height) of the result in pixels: the recipe's size, or the picture's own."""
    if recipe.output.size is None:
        return picture.width, picture.height
    longer = max(picture.width, picture.height)
    width, height = (max(1, round(side * recipe.output.size / longer)) for side in (picture.width, picture.height))
    return width, height


def with_alpha(pixels: np.ndarray) -> np.ndarray:
    """(h, w, 1-4) with an alpha channel: opaque where there was none."""
    if pixels.shape[2] in (2, 4):
        return pixels
    return np.concatenate([pixels, np.full_like(pixels[..., :1], opaque_value(pixels))], axis=2)


def opaque_value(pixels: np.ndarray) -> int:
    """The alpha of a pixel that hides what is below it."""
    return 1 if pixels.dtype == np.float32 else np.iinfo(pixels.dtype).max
