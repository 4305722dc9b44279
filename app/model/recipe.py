"""The recipe: everything that makes a warp, in one readable, versioned, validated value.

Long, as its small parts stand before it; what it is made of in lists is in modules of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise, zip_longest
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import Field, ValidationError, model_validator

from app.errors import UserError
from app.model import forces, strokes, toml
from app.model.forces import Force
from app.model.handles import MOST_HANDLES, MOST_LINES, RecipeHandle, RecipePin
from app.model.mask_edits import MaskEdit, remaining
from app.model.masks import FreezeLayer, ViscosityLayer
from app.model.schema import FileName, Model, Place, Radius, Several, frozen, plain
from app.model.strokes import Change, Stroke
from app.model.validation import complaint

VERSION = 5
UNNAMED = "the recipe"  # what messages call one of which nothing else is known
MOST_TICKS = 1_000_000
MOST_WATCHED = 100  # points, sought after every tick
FINEST_GRID = 4096  # cells along the longer side
_SAMPLES = "\ue000 samples"  # a character that nobody writes

T = TypeVar("T")
Seconds = Annotated[float, Field(ge=0, le=100_000)]


class FluidSettings(Model):
    """The fluid and the grid it is computed on.

    Attributes:
        solver: "mac", the default scheme, or "paper", the paper's own.
        grid: cells along the picture's longer side.
        dt: seconds a tick.
        viscosity: of the whole picture, in longer sides squared per second; layers and strokes work on it.
        drag: rate at which all motion dies away, per second.
        walls: "free-slip" glides along the picture's edge, "no-slip" sticks to it.
        sweeps: Jacobi sweeps of the solver "paper".
    """

    solver: Literal["mac", "paper"] = "mac"
    grid: Annotated[int, Field(ge=8, le=FINEST_GRID)] = 256
    dt: Annotated[float, Field(gt=0, le=10)] = 1 / 60
    viscosity: Annotated[float, Field(ge=0, le=1000)] = 0.001
    drag: Annotated[float, Field(ge=0, le=1000)] = 0.0
    walls: Literal["free-slip", "no-slip"] = "free-slip"
    sweeps: Annotated[int, Field(ge=1, le=10_000)] = 40


class DensitySettings(Model):
    """Eq. (5): the picture's values as a density that diffuses with `kappa` while `source` is fed into it.

    Attributes:
        kappa: diffusion rate, in longer sides squared per second.
        source: colour added per second, red, green and blue of 0-1.
    """

    kappa: Annotated[float, Field(ge=0, le=1000)] = 0.0
    source: Several[Annotated[float, Field(ge=-1000, le=1000)]] = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _three(self) -> Self:
        if len(self.source) != 3:
            raise ValueError(f"'source' must be three numbers (red, green, blue), not {len(self.source)}")
        return self


class Watch(Model):
    """A point of the picture that ends the simulation when it has moved far enough, or has reached a place.

    Attributes:
        point: where it starts, as fractions of width and height.
        distance: stop when it has moved this far, in longer sides.
        place: stop when it is within `within` of this place (fractions of width and height).
        within: in longer sides.
    """

    point: tuple[Place, Place]
    distance: Annotated[float, Field(gt=0, le=10)] | None = None
    place: tuple[Place, Place] | None = None
    within: Radius = 0.01

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.distance is None) == (self.place is None):
            raise ValueError("give either 'distance' or 'place'")
        return self


class Stop(Model):
    """Conditions that end the simulation before its duration, whichever comes first.

    Attributes:
        energy_below: kinetic energy (half the mean squared speed times the area), once it has been above.
        speed_below: largest speed, in longer sides per second, once it has been above.
        displacement_above: largest displacement of the warp map, in longer sides.
        det_below: smallest det J of the warp map: 0 is a fold.
        handles_within: all handles are this near to where they are led, in longer sides; 0.001 is half a pixel of 512.
        watch: points of the picture.
    """

    energy_below: Annotated[float, Field(gt=0)] | None = None
    speed_below: Annotated[float, Field(gt=0)] | None = None
    displacement_above: Annotated[float, Field(gt=0)] | None = None
    det_below: Annotated[float, Field(lt=1)] | None = None
    handles_within: Annotated[float, Field(gt=0, le=1)] | None = None
    watch: Annotated[Several[Watch], Field(max_length=MOST_WATCHED)] = ()


class Playback(Model):
    """How an animation runs through the warps W_t; the simulation itself is not touched by it.

    Attributes:
        speed: simulated seconds per second of animation; 0.5 is slow motion.
        reverse: from the last warp to the first.
        ping_pong: there and back again.
        dissolve: seconds of the animation in which its end dissolves into its beginning, so that a loop of it has no
            jump and never turns back. What dissolves is shown at the end only, and the animation shorter by as much.
        hold_first, hold_last: seconds that the first and last frame stand still.
        start, end: the part of the simulation that is shown, in simulated seconds.
    """

    speed: Annotated[float, Field(gt=0, le=1000)] = 1.0
    reverse: bool = False
    ping_pong: bool = False
    dissolve: Seconds = 0.0
    hold_first: Seconds = 0.0
    hold_last: Seconds = 0.0
    start: Seconds = 0.0
    end: Seconds | None = None

    @model_validator(mode="after")
    def _forwards(self) -> Self:
        if self.end is not None and self.end < self.start:
            raise ValueError(f"'end' ({self.end:g}) is before 'start' ({self.start:g})")
        for name in ("ping_pong", "hold_first", "hold_last"):
            if self.dissolve and getattr(self, name):
                raise ValueError(f"'dissolve' and {name!r} do not go together; leave one out")
        return self


class Output(Model):
    """What is written.

    Attributes:
        size: longer side of the result in pixels; left out, the picture's own.
        fps: frames per second of an animation.
        quality: 1-100, of JPEG, WebP, AVIF and video.
        samples: places looked up along a side of each pixel: "auto", as many as the map stretches there; 1 is sharper,
            and shows steps where the map shrinks the picture.
        filter: between pixels. "catmull-rom" is sharp, and overshoots beside hard edges, below zero too; "limited" is
            the same without overshooting, for HDR; "bilinear" is softer; "nearest" keeps pixels as they are.
    """

    size: Annotated[int, Field(ge=1, le=32768)] | None = None
    fps: Annotated[float, Field(gt=0, le=1000)] = 30.0
    quality: Annotated[int, Field(ge=1, le=100)] = 90
    samples: Literal["auto", 1] = "auto"
    filter: Literal["catmull-rom", "limited", "bilinear", "nearest"] = "catmull-rom"


class Recipe(Model):
    """Everything that makes a warp; see the modules of its parts for the units.

    Attributes:
        version: of this format. In version 1 strokes had no `detail`, in version 2 there were no handles, in version 3
            masks were only painted in time, in version 4 handles were points that nobody turned; one that is older
            becomes one of this version when it is read.
        name: a title.
        picture: the source, relative to the recipe's own folder.
        map: a warp map to begin with instead of the picture as it is, in any format of `app.media.maps`.
        duration: T, in simulated seconds.
        amount: how much of the warp is seen; 1 is all of it.
        edges: what lies beyond the picture's edge.
        mode: "coordinates" warps the picture's coordinates, "density" moves its values (see `DensitySettings`).
        viscosity, freeze, force, stroke, change: applied in the order they are written in.
        mask: what is done to the masks in no time, in this order, before all else that begins at the same tick.
        handle, pin: in force all at once.
    """

    version: Literal[5] = VERSION
    name: str = ""
    picture: FileName | None = None
    map: FileName | None = None
    duration: Annotated[float, Field(gt=0, le=1_000_000)] = 1.0
    amount: Annotated[float, Field(ge=0, le=1.5)] = 1.0
    edges: Literal["transparent", "black", "clamp", "mirror", "wrap"] = "transparent"
    mode: Literal["coordinates", "density"] = "coordinates"
    fluid: FluidSettings = FluidSettings()
    density: DensitySettings = DensitySettings()
    stop: Stop = Stop()
    time: Playback = Playback()
    output: Output = Output()
    viscosity: Several[ViscosityLayer] = ()
    freeze: Several[FreezeLayer] = ()
    force: Several[Force] = ()
    handle: Several[RecipeHandle] = ()
    pin: Several[RecipePin] = ()
    change: Several[Change] = ()
    mask: Several[MaskEdit] = ()
    stroke: Several[Stroke] = ()

    @model_validator(mode="before")
    @classmethod
    def _of_this_version(cls, data: Any) -> Any:
        """What an older version had not, this one has by default, and it means the same."""
        if isinstance(data, dict) and type(data.get("version")) is int and 1 <= data["version"] < VERSION:
            return {**data, "version": VERSION}
        return data

    @model_validator(mode="before")
    @classmethod
    def _few_are_led(cls, data: Any) -> Any:
        """Counted before each is looked at, which takes a second for 20,000 of them."""
        given = [data.get(key) for key in ("handle", "pin")] if isinstance(data, dict) else []
        led = sum(len(each) for each in given if isinstance(each, (list, tuple)))
        if led > MOST_HANDLES:
            raise ValueError(f"there are {led} handles and pins; at most {MOST_HANDLES} work")
        return data

    @model_validator(mode="after")
    def _affordable(self) -> Self:
        if self.duration / self.fluid.dt > MOST_TICKS:
            raise ValueError(f"'duration' / 'fluid.dt' is more than {MOST_TICKS} ticks; make dt larger")
        if self.map is not None and self.mode == "density":
            raise ValueError("a 'map' warps coordinates, and mode \"density\" has none; remove one of them")
        if self.amount != 1 and self.mode == "density":
            raise ValueError("'amount' scales a warp of coordinates, and mode \"density\" has none; remove one of them")
        if said := self.excess:
            raise ValueError(said)
        if (lines := sum(bool(led.points) for led in (*self.handle, *self.pin))) > MOST_LINES:
            raise ValueError(f"there are {lines} lines that are led or held; at most {MOST_LINES} work")
        if self.stop.handles_within is not None and not self.handle:
            raise ValueError("'stop.handles_within' waits for handles, and there is no [[handle]]")
        for key, things in (("change", self.change), ("mask", self.mask)):
            if any(later.tick < earlier.tick for earlier, later in pairwise(things)):
                raise ValueError(f"the ticks of [[{key}]] must not go backwards")
        return self

    # -- text -------------------------------------------------------------------------------------------------------

    @classmethod
    def parse(cls, text: str, source: str = UNNAMED) -> Self:
        """The recipe written in `text`.

        Raises:
            UserError: naming `source`, the line, the key, and what was expected.
        """
        data = toml.parsed(text, source)
        version = data.get("version", VERSION)
        if isinstance(version, int) and version > VERSION:
            raise UserError(
                f"{source} is of version {version}, and this fluidwarp reads recipes up to version {VERSION}; "
                "install a newer fluidwarp"
            )
        try:
            return cls.model_validate(frozen(data))
        except ValidationError as error:
            raise complaint(error, cls, data, text, source) from None

    @classmethod
    def decode(cls, data: bytes, source: str) -> Self:
        """The recipe in the bytes of a file. Raises `UserError` as `parse`."""
        try:
            text = data.decode("utf-8-sig")  # some editors put a mark before the text
        except UnicodeDecodeError:
            raise UserError(f"{source} is not a recipe: it is not text, or not saved as UTF-8") from None
        return cls.parse(text, source)

    def text(self) -> str:
        """The recipe as TOML, without what is as by default; `parse` gives the same recipe back, bit for bit."""
        import tomlkit

        document, samples = tomlkit.document(), []
        for key, value in plain(self).items():
            if not (isinstance(value, list) and value and isinstance(value[0], dict)):
                document.add(key, tomlkit.item(value))
                continue
            tables = tomlkit.aot()
            for entry in value:
                if "samples" in entry:
                    # Of samples there are thousands, and tomlkit takes its time over each; a list's repr is TOML too.
                    samples.append(repr(entry["samples"]))
                    entry["samples"] = _SAMPLES
                tables.append(tomlkit.item({name: _inline(part) for name, part in entry.items()}))
            document.add(key, tables)
        pieces = tomlkit.dumps(document).split(f'"{_SAMPLES}"')
        return "".join(part for pair in zip_longest(pieces, samples, fillvalue="") for part in pair)

    # -- what it says -----------------------------------------------------------------------------------------------

    @property
    def excess(self) -> str | None:
        """A message if it has more forces or strokes at once than work; else None."""
        return forces.excess(self.force) or strokes.excess(self.stroke)

    @property
    def ticks(self) -> int:
        """The whole number of steps nearest to the duration, at least 1."""
        return max(1, round(self.duration / self.fluid.dt))

    @property
    def recorded(self) -> int:
        """Ticks in which something is done; 0 where nothing has been yet."""
        acts = self.stroke or self.change or self.force or self.handle
        return self.ticks if acts or any(edit.tick for edit in self.mask) else 0

    @property
    def begins(self) -> int:
        """The first tick at which anything is done: up to it, fluid and picture are as they were."""
        if self.force or self.freeze or self.map is not None or self.mode == "density":
            return 0
        led = (one.first_tick(self.fluid.dt) for one in (*self.handle, *self.pin))
        drawn = (stroke.first_tick for stroke in self.stroke if not stroke.muted)
        return min([*led, *drawn, *(one.tick for one in (*self.change, *self.mask))], default=MOST_TICKS)

    @property
    def pushes(self) -> bool:
        """True if it has forces that are not muted."""
        return any(not force.muted for force in self.force)

    @property
    def leads(self) -> bool:
        """True if it has handles or pins."""
        return bool(self.handle or self.pin)

    def lets_go(self, led: RecipeHandle | RecipePin) -> bool:
        """True if a handle or a pin has let go before the end: what it has done is not asked of that any more."""
        return not led.muted and led.end is not None and led.let_go <= (self.ticks - 0.5) * self.fluid.dt

    @property
    def can_fit(self) -> bool:
        """True if it has handles that lead somewhere, and hold it to the end."""
        return any(handle.is_led and not (handle.muted or self.lets_go(handle)) for handle in self.handle)

    def fluid_at(self, tick: int) -> FluidSettings:
        """The fluid's settings in force during `tick`, with all changes up to it."""
        changed: dict[str, Any] = {}
        for change in self.change:
            if change.tick <= tick:
                for key in ("viscosity", "drag", "walls"):
                    if (value := getattr(change, key)) is not None:
                        changed[key] = value
        return self.fluid.model_copy(update=changed) if changed else self.fluid

    def masks_at(self, tick: int) -> tuple[MaskEdit, ...]:
        """What is done to the masks at a tick, before its step."""
        return tuple(edit for edit in self.mask if edit.tick == tick)

    def edited(self, **parts: Any) -> Self:
        """The recipe with some of its parts replaced by parts that are valid in themselves; shares all the others.

        Where no handle is left, none is waited for any more, unless `parts` has what ends it.
        """
        edited = self.model_copy(update=parts)
        if "stop" in parts or edited.handle or edited.stop.handles_within is None:
            return edited
        return edited.edited(stop=edited.stop.model_copy(update={"handles_within": None}))

    def on_grid(self, cells: int) -> Self:
        """The recipe, simulated on another grid."""
        return self.edited(fluid=self.fluid.model_copy(update={"grid": cells}))

    def checked(self, source: str = UNNAMED) -> Self:
        """The recipe, validated as a whole again: for parts that came from outside, that is from `source`.

        Raises:
            UserError: naming the key and what was expected.
        """
        data = plain(self)
        try:
            return type(self).model_validate(frozen(data))
        except ValidationError as error:
            raise complaint(error, type(self), data, "", source) from None

    def agrees_until(self, other: Recipe) -> float:
        """The tick before which both recipes simulate the same; infinite where they do so for ever.

        Checkpoints up to that tick are common to both; one at it, if `goes_on_from` says so.
        """
        if not self.is_set_up_as(other):
            return 0
        agreed: float = float("inf")
        for mine, theirs in _differing(self.stroke, other.stroke):
            if mine is not None and theirs is not None:
                agreed = min(agreed, mine.agrees_until(theirs))
            else:
                agreed = min([agreed, *(stroke.starts for stroke in (mine, theirs) if stroke is not None)])
        for mine, theirs in _differing(self.force, other.force):
            if mine is not None and theirs is not None:
                agreed = min(agreed, mine.agrees_until(theirs, self.fluid.dt))
            else:
                agreed = min([agreed, *(force.starts(self.fluid.dt) for force in (mine, theirs) if force is not None)])
        renumbered = self.pin != other.pin
        for mine, theirs in zip_longest(self.handle, other.handle):
            if mine is theirs and not renumbered:
                continue
            if not any(led is not None and led.takes_hold for led in (mine, theirs)):
                continue
            if mine is not None and theirs is not None:
                renumbered |= mine.takes_hold != theirs.takes_hold  # those behind it
            if mine is not None and theirs is not None and mine != theirs and not renumbered:
                agreed = min(agreed, mine.agrees_until(theirs, self.fluid.dt))
            elif mine != theirs or renumbered:
                agreed = min([agreed, *(led.first_tick(self.fluid.dt) for led in (mine, theirs) if led is not None)])
        if self.pin != other.pin:
            agreed = min([agreed, *(led.first_tick(self.fluid.dt) for led in (*self.pin, *other.pin))])
        for mine, theirs in (*zip_longest(self.change, other.change), *zip_longest(self.mask, other.mask)):
            if mine is not theirs and mine != theirs:
                agreed = min([agreed, *(change.tick for change in (mine, theirs) if change is not None)])
        return agreed

    def goes_on_from(self, other: Recipe, tick: int) -> bool:
        """True if a simulation of `other` that has come to a tick, with all masks there, is on the way of this one."""
        if (agreed := self.agrees_until(other)) != tick:
            return agreed > tick
        return remaining(self.masks_at(tick), other.masks_at(tick)) is not None

    def is_set_up_as(self, other: Recipe) -> bool:
        """True if both are the same simulation but for strokes, forces, edits of masks, changes, handles and pins."""
        return self._set_up() == other._set_up()

    def _set_up(self) -> tuple[object, ...]:
        """What is in force from the first tick on."""
        layers = self.viscosity, self.freeze, self.pushes
        return self.picture, self.map, self.mode, self.density, self.fluid, *layers


def _differing(mine: tuple[T, ...], theirs: tuple[T, ...]) -> Iterator[tuple[T | None, T | None]]:
    """The parts that are not the same, in pairs from where they first differ; what both end with is left out."""
    if mine is theirs:
        return
    both, start, end = min(len(mine), len(theirs)), 0, 0
    while start < both and (mine[start] is theirs[start] or mine[start] == theirs[start]):
        start += 1
    while end < both - start and (mine[-1 - end] is theirs[-1 - end] or mine[-1 - end] == theirs[-1 - end]):
        end += 1
    for one, other in zip_longest(mine[start : len(mine) - end], theirs[start : len(theirs) - end]):
        if one is not other and one != other:
            yield one, other


def _inline(value: Any) -> Any:
    """A table within a table of a list, as `{ ... }` on its own line: headers of headers are hard to read."""
    import tomlkit

    if isinstance(value, list) and value and isinstance(value[0], dict):
        tables = tomlkit.array()
        tables.extend(_inline(part) for part in value)
        return tables
    if not isinstance(value, dict):
        return value
    table = tomlkit.inline_table()
    table.update({name: _inline(part) for name, part in value.items()})
    return table
