"""The command line, `fluidwarp edit | render | fit | apply | ...`; most of it declares options."""

from __future__ import annotations

import errno
import os
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from app.errors import BUG, About, Cancelled, UserError, shown
from app.progress import INTERRUPTED, deaf_children

if TYPE_CHECKING:
    from app.work.apply_job import MapSource
    from app.work.tasks import Piece
    from app.work.worker import Outcome

# Whatever is slow to import is imported where it is used: a command line has to answer at once.

UNPRINTED = {
    errno.ENOSPC: "the disk is full; free some space",
    errno.EBADF: "its output is open for reading only; check what it is redirected to",
}
"""Why what is printed cannot be written, and the mend."""


def _is_sequence(name: str) -> bool:
    from app.media.numbered import is_sequence

    return is_sequence(name)


class CommandOrFile(TyperGroup):
    """The commands; what is none of them is a file, which the editor opens."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name = args[0]
        # A command stays one whatever lies in the folder: a file of that name is ./render.
        if name in self.commands or name.startswith("-"):
            return super().resolve_command(ctx, args)
        if os.path.exists(name) or _is_sequence(name):
            return super().resolve_command(ctx, ["edit", *args])
        if Path(name).suffix or Path(name).name != name:
            from app.media.inputs import NO_ADDRESS, is_address

            if is_address(name):
                raise UserError(f"Cannot read {name}: {NO_ADDRESS}.")
            raise UserError(f"{name} does not exist; check the name of the picture, clip, recipe or project")
        raise UserError(f"{name} is neither a file nor a command; the commands are {', '.join(self.commands)}", 2)


cli = typer.Typer(
    name="fluidwarp",
    cls=CommandOrFile,
    subcommand_metavar="[FILE | COMMAND [ARGS]...]",
    help="Warp pictures by simulating a fluid.\n\n"
    "`fluidwarp` alone opens the editor; `fluidwarp FILE` opens a picture, clip, recipe or project in it. "
    "`fluidwarp COMMAND --help` explains a command.",
    no_args_is_help=False,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> None:
    """Run the command line; what goes wrong ends in one message on stderr and a status that is not 0."""
    for name in ("stdout", "stderr"):  # a daemon may have closed them
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
    try:
        if not _has_folder():
            raise UserError("the folder that this runs in is gone; go to another one")
        if "" in sys.argv[1:]:
            raise UserError("one of the words of this command is empty; is a variable in it not set?")
        status = None
        if sys.argv[1:] == ["--version"]:  # without pydantic, which typer loads for any option, and takes as long again
            _print_version()
        else:
            status = cli(standalone_mode=False)
            if status == INTERRUPTED:  # typer has made that of the exception
                raise KeyboardInterrupt
        sys.stdout.flush()  # where that cannot be, it is told here, and not by Python at its end
        sys.exit(status)
    except UserError as error:
        _fail(str(error), error.status)
    except Cancelled:
        _fail("cancelled; nothing half-written is left", INTERRUPTED)
    except KeyboardInterrupt:
        _fail("interrupted", INTERRUPTED)
    except BrokenPipeError:
        # The reader has gone, as `| head` does; Python must not try to flush to it on its way out.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except MemoryError:
        _fail("there is not enough memory; try a smaller --size or --grid", 1)
    except Exception as error:
        if any(kind.__name__ == "ContextError" for kind in type(error).__mro__):  # without the time to import it
            _fail(f"{error}; `fluidwarp doctor` tells more", 1)
        if hasattr(error, "format_message"):  # click's; under which name typer has it depends on the release
            _fail(_usage(error), 2)
        if os.environ.get("FLUIDWARP_TRACEBACK"):
            raise
        if isinstance(error, OSError) and error.errno in UNPRINTED:  # what files cannot be written is told as that
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            _fail(f"what this prints cannot be written: {UNPRINTED[error.errno]}", 1)
        words = str(error).strip().splitlines()
        said = f": {words[0]}" if words else ""
        _fail(f"this is a bug in fluidwarp ({type(error).__name__}{said}); FLUIDWARP_TRACEBACK=1 shows where", BUG)


def _has_folder() -> bool:
    """The folder that names start from is there."""
    try:
        os.getcwd()
    except OSError:
        return False
    return True


def _usage(error: Any) -> str:
    """What is wrong with the words of a command line, and where they are explained."""
    said, context = _wrong_value(error) or error.format_message().rstrip("."), getattr(error, "ctx", None)
    command = "" if context is None or context.parent is None else f" {context.info_name}"
    if context is None and sys.argv[1] in _names():  # click names none where an option lacks its argument
        command = f" {sys.argv[1]}"
    return f"{said[:1].lower()}{said[1:]}; `fluidwarp{command} --help` explains what is wanted"


def _wrong_value(error: Any) -> str:
    """What is wrong with the value of an option; "" if it is something else."""
    option = next((name for name in getattr(getattr(error, "param", None), "opts", ()) if name.startswith("--")), "")
    if not option or type(error.__cause__).__name__ != "ValidationError":
        return ""
    from app.model.validation import expected

    wanted = expected(error.__cause__)
    return wanted and f"{option} must be {wanted}"


def _names() -> set[str]:
    """The commands as they are typed."""
    return {command.name or command.callback.__name__ for command in cli.registered_commands if command.callback}


def _print_version() -> None:
    from importlib.metadata import version

    print(f"fluidwarp {version('fluidwarp')}")


def _fail(message: str, status: int) -> NoReturn:
    _tell(message)
    sys.exit(status)


def _tell(*lines: str) -> None:
    """Say what the user should hear of, a line each, on stderr; what cannot be told there costs no work."""
    try:
        for line in filter(None, lines):
            print(f"fluidwarp: {shown(line)}", file=sys.stderr, flush=True)
    except OSError:  # a file on a full disk, or a reader who has gone; Python must not try again on its way out
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


def flag(name: str, says: str) -> Any:
    """An option that takes no value, and shows none in the help."""
    return typer.Option(name, metavar="", help=says)


Output = Annotated[
    Path,
    typer.Option("--output", "-o", metavar="OUT", help="File to write; its extension sets the format.", readable=False),
]


@cli.callback(invoke_without_command=True)
def start(
    context: typer.Context,
    version: Annotated[bool, flag("--version", "Show the version and exit.")] = False,
) -> None:
    """Without a command, opens the editor; with a picture, a clip, a recipe or a project alone, on that."""
    if version:
        _print_version()
        raise typer.Exit
    if context.invoked_subcommand is None:
        edit(None)


@cli.command()
def edit(
    file: Annotated[
        Path | None,
        typer.Argument(help="Picture, clip, numbered files (f.%04d.png), recipe or project to open.", readable=False),
    ] = None,
) -> None:
    """Open the editor."""
    try:
        with deaf_children():  # glfw asks one whether it can be loaded
            from app.ui.window import run
    except ImportError as error:
        raise UserError(f"the window cannot be loaded ({error}); `fluidwarp doctor` says what is missing", 2) from None
    run(file)


# Paths are `readable=False`: files are looked at where they are opened, so that one of many does not stop the others,
# and what cannot be read or written is told in sentences of our own.

RecipeName = Annotated[
    str,
    typer.Argument(
        metavar="RECIPE", help="Recipe (.toml), project, or the name of a recipe that comes with fluidwarp."
    ),
]
MaxPixels = Annotated[int, typer.Option(min=1, help="Refuse pictures, clips and maps with more pixels than this.")]
Bits = Annotated[int | None, typer.Option(help="Bits per channel: 8, 16 (half in EXR) or 32. Default: the picture's.")]
Size = Annotated[int | None, typer.Option(help="Longer side of the result, in pixels.")]
Quality = Annotated[int | None, typer.Option(help="Quality of JPEG, WebP, AVIF and video, 1 to 100.")]
Filter = Annotated[
    str | None,
    typer.Option(
        "--filter", help="Interpolation: catmull-rom (sharp), limited (sharp without ringing), bilinear or nearest."
    ),
]
Frames = Annotated[
    str | None,
    typer.Option(metavar="A-B", help="Only these frames of an animation, from 0; of numbered files, by their numbers."),
]
Resume = Annotated[bool, flag("--resume", "Skip files of a sequence that are already up to date.")]
Jobs = Annotated[int, typer.Option("--jobs", "-j", min=1, help="Number of processes, for several pictures.")]
Cluster = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Dask scheduler to hand several pictures to, such as tcp://host:8786."),
]
Verbose = Annotated[
    bool, typer.Option("--verbose", help="With several pictures, print the messages of each when it is done.")
]
Dpi = Annotated[
    float | None,
    typer.Option(min=1, max=10_000, help="Dots per inch to note in a picture for print. Default: its own."),
]
Strip = Annotated[bool, flag("--strip", "Leave out metadata, but not the colour profile.")]
Codec = Annotated[
    str | None,
    typer.Option(help="Another codec: h265 in .mp4, av1 in .webm, prores-422-hq in .mov; piz, dwaa ... in .exr."),
]
Gpu = Annotated[
    int | None,
    typer.Option("--gpu", min=0, help="Graphics device to use, by its number in `fluidwarp doctor`."),
]
MapKind = Annotated[str | None, typer.Option("--kind", help="Kind of MAP, if the file does not say: st or offsets.")]
StGrid = Annotated[
    str | None,
    typer.Option("--grid", help="Where MAP's 0 and 1 are, if the file does not say: centres, corners or pixels."),
]
MapOverscan = Annotated[
    int | None,
    typer.Option("--overscan", min=0, help="Pixels that MAP adds on each side, if the file does not say."),
]


@cli.command()
def render(
    recipe: RecipeName,
    pictures: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="PICTURE",
            help="Pictures, clips or numbered files (f.%04d.exr) to warp instead of the recipe's.",
            readable=False,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="OUT",
            help="File to write; its extension sets the format. Default: out.png",
            readable=False,
        ),
    ] = None,
    image: Annotated[Path | None, typer.Option("--image", "-i", help="The same as PICTURE.", readable=False)] = None,
    stats: Annotated[
        Path | None, typer.Option(help="Write energy, speed, det J and folds of each frame.", readable=False)
    ] = None,
    map_: Annotated[
        Path | None,
        typer.Option(
            "--map",
            help="Write the last frame's warp map (.exr .tif .flo .npy), or every frame's (m.%04d.exr).",
            readable=False,
        ),
    ] = None,
    forward: Annotated[
        bool, flag("--forward", "Map says where points of the original go, not where they come from.")
    ] = False,
    offsets: Annotated[bool, flag("--offsets", "Pixel offsets in the map, instead of an ST map.")] = False,
    overscan: Annotated[int, typer.Option(min=0, help="Pixels to add to the map on each side of the picture.")] = 0,
    map_size: Annotated[int | None, typer.Option(min=6, help="Longer side of the map, in pixels.")] = None,
    size: Size = None,
    filter_: Filter = None,
    grid: Annotated[int | None, typer.Option(help="Cells of the simulation along the longer side.")] = None,
    solver: Annotated[
        str | None, typer.Option(help="How to simulate: mac (usual), or paper (the paper's own scheme).")
    ] = None,
    duration: Annotated[float | None, typer.Option(help="Seconds to simulate.")] = None,
    amount: Annotated[float | None, typer.Option(help="Part of the warp to apply, 0 to 1.5; 1 is all of it.")] = None,
    fps: Annotated[
        float | None, typer.Option(help="Frames per second of a picture's animation; a clip keeps its own.")
    ] = None,
    quality: Quality = None,
    start: Annotated[float | None, typer.Option("--from", help="Second at which the animation begins.")] = None,
    end: Annotated[float | None, typer.Option("--to", help="Second at which the animation ends.")] = None,
    frames: Frames = None,
    resume: Resume = False,
    states: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder to save states of the simulation in; later parts start from them.",
            readable=False,
        ),
    ] = None,
    animated: Annotated[bool, flag("--animated", "Write OUT.webp as an animation, not a still.")] = False,
    codec: Codec = None,
    bits: Bits = None,
    dpi: Dpi = None,
    strip: Strip = False,
    max_pixels: MaxPixels = 400_000_000,
    jobs: Jobs = 1,
    cluster: Cluster = None,
    verbose: Verbose = False,
    gpu: Gpu = None,
) -> None:
    """Warp pictures, clips or numbered files by a recipe.

    OUT.png is the picture at the end, OUT.mp4 or OUT.gif the animation, OUT.%04d.png its frames.
    A clip is warped frame by frame, and keeps its sound.

    If OUT has no ending, or there are several pictures, OUT is a folder for them, and each keeps its name.
    Or give a name for each, such as OUT/{name}-w.png.
    """
    from app.work.jobs import MapOutput, Outputs
    from app.work.tasks import Task, edited, opened

    edits = {
        "fluid.grid": grid, "fluid.solver": solver, "output.size": size, "output.fps": fps, "output.quality": quality,
        "output.filter": filter_, "time.start": start, "time.end": end, "duration": duration, "amount": amount,
    }  # fmt: skip
    edited(opened(recipe, max_pixels).recipe, edits)
    if output is None and map_ is None:
        output = Path("out.png")
    maps = MapOutput(map_, "offsets" if offsets else "st", forward, overscan, map_size) if map_ else None
    if maps is None and (forward or offsets or overscan or map_size):
        raise UserError(
            "--forward, --offsets, --overscan and --map-size say how --map is written; give --map and a name"
        )
    given = [*([image] if image else []), *(pictures or [])]
    outputs = Outputs(
        output, stats, maps, part=_part(frames), animated=animated, bits=bits, strip=strip, codec=codec, states=states,
        resume=resume, dpi=dpi,
    )  # fmt: skip
    task = Task(recipe=recipe, edits=edits, picture=given[0] if given else None, outputs=outputs, max_pixels=max_pixels)
    if not given and cluster is not None:
        raise UserError("--cluster is for several pictures; name them after the recipe")
    _perform(task, given, jobs, cluster, gpu, verbose)


def _check_output(*outputs: Path | None) -> None:
    """Raise `UserError` for what is no name of a file or a folder, though one could be made of it."""
    from app.media.encoders import ANIMATIONS
    from app.media.formats import FORMATS

    for output in filter(None, outputs):
        if str(output) == "-":
            raise UserError("a result is a file, and not standard output (-); give it a name, such as out.png")
        if output.name.lower() in (*FORMATS, *ANIMATIONS):
            raise UserError(f"{output} is an ending without a name; give one such as out{output.name}")


def _perform(piece: Piece, given: list[Path], jobs: int, cluster: str | None, gpu: int | None, verbose: bool) -> None:
    """Do it for all that is given, one or many."""
    _check_output(*piece.outputs.files, piece.outputs.states)
    if gpu is not None and cluster is not None:
        raise UserError("--gpu is for this machine; start the workers of --cluster with FLUIDWARP_GPU set instead")
    _choose(gpu)
    from app.media.files import no_empty_folder
    from app.progress import on_terminal
    from app.work.tasks import spread
    from solver.gl.device import Device

    output = piece.outputs.file
    if len(given) > 1 or cluster is not None or (given and output and _is_folder(output)):
        pieces = spread(piece, given)
        with ExitStack() as stack:
            for folder in dict.fromkeys([*(one.folder for one in pieces), piece.outputs.states]):
                stack.enter_context(no_empty_folder(folder))
            _perform_many(pieces, jobs, cluster, verbose)
        return
    piece = piece.named()
    with (
        no_empty_folder(piece.folder),
        no_empty_folder(piece.outputs.states),
        ExitStack() as stack,
        on_terminal(piece.outputs.files[0].name, None, warn=_tell) as progress,
    ):
        report = piece.perform(lambda: stack.enter_context(Device.headless()), progress)
    _tell(*report.notices, *([report.verdict] if report.verdict else []))


def _choose(gpu: int | None) -> None:
    """Let this process, and all that it starts, draw on a graphics device."""
    from solver.gl.context import GPU

    if gpu is not None:
        os.environ[GPU] = str(gpu)


def _is_folder(output: Path) -> bool:
    return os.path.isdir(output) or output.suffix == ""


def _part(frames: str | None) -> tuple[int, int | None]:
    """The first and the last frame of "A-B", "A-" or "A"."""
    if frames is None:
        return 0, None
    first, dash, last = frames.partition("-")
    numbers = [number for number in (first, last) if number]
    whole = first and all(number.isascii() and number.isdecimal() and len(number) < 16 for number in numbers)
    if not whole or (last and int(last) < int(first)):
        raise UserError(f"--frames must be like 0-99, 100- or 7, not {frames}")
    return int(first), (int(last) if last else None if dash else int(first))


def _perform_many(tasks: Sequence[Piece], jobs: int, cluster: str | None, verbose: bool) -> None:
    """Do all; what is to be said of several, and why one fails, is said of the first, unless `verbose`, and counted."""
    from app.media.numbered import number_in
    from app.progress import leave, on_terminal
    from app.work.batch import run_batch
    from app.work.tasks import NAME

    written, repeated = 0, Counter[str]()
    failed: list[Outcome] = []

    own = {
        task.label: {task.label, Path(task.label).name, *(path.name for path in task.outputs.files)} for task in tasks
    }

    def alike(label: str, said: str) -> str:
        """What is said of whichever picture, where it is about a file that is this one's alone."""
        if not isinstance(said, About):
            return said
        if said.file in own[label] or any(number_in(name, said.file) is not None for name in own[label]):
            return said.of(NAME + Path(said.file).suffix)
        return said

    def new(label: str, *notices: str) -> list[str]:
        found = [said for said in notices if verbose or alike(label, said) not in repeated]
        repeated.update(alike(label, said) for said in notices)
        return found

    def warn(label: str, said: str) -> None:
        _tell(*(_about(label, each) for each in new(label, said)))

    def report(outcome: Outcome) -> None:
        nonlocal written
        if outcome.error:
            failed.append(outcome)
        written += not outcome.error
        error = outcome.error if verbose or len(failed) == 1 else ""  # the names of those that fail come at the end
        said = error, *new(outcome.label, *outcome.notices), outcome.verdict
        _tell(*(_about(outcome.label, each) for each in said if each))

    many = f"{len(tasks)} picture{'s' * (len(tasks) > 1)}"
    alone = jobs == 1 or cluster is not None  # no processes of ours, which would have to be waited for
    try:
        with on_terminal(many, len(tasks), leave if alone else None) as progress:
            failures = run_batch(tasks, report, progress, jobs, cluster, _tell, warn)
    except Cancelled:
        _fail(f"cancelled; {written} of {many} are written, nothing is half-written", INTERRUPTED)
    if not verbose:
        _tell(*(f"and of {count - 1} more: {said}" for said, count in repeated.items() if count > 1))
    if failures and len(tasks) == 1:
        raise typer.Exit(1)
    if failures:
        others = "all others are written" if failures < len(tasks) else "none is written"
        order = {task.label: number for number, task in enumerate(tasks)}
        failed.sort(key=lambda one: order[one.label])
        raise UserError(f"{failures} of {len(tasks)} pictures failed{_named(failed, verbose)}; {others}")


def _named(failed: Sequence[Outcome], verbose: bool) -> str:
    """Which of several have failed, and, unless it is told, whether what is told of the first goes for all of them."""
    from app.media.numbered import listed

    if len(failed) == 1:
        return ""
    named = [(shown(outcome.label), shown(Path(outcome.label).name), outcome.error) for outcome in failed]
    whys = {error.replace(label, "").replace(name, "") for label, name, error in named}
    names = [Path(outcome.label).name for outcome in failed]
    told, all_of_them = listed(names if len({*names}) == len(names) else [outcome.label for outcome in failed])
    wanted = "" if verbose or (all_of_them and len(whys) < 2) else f" tells {'why' if len(whys) > 1 else 'all names'}"
    return f": {told}{wanted and f'; --verbose{wanted}'}"


def _about(label: str, said: str) -> str:
    """What is said of a picture, with its whole name in it once."""
    label = shown(label)
    if said.startswith((f"Cannot read {label}", label)):
        return said
    return f"{label}: {said.removeprefix(f'{Path(label).name}: ')}"


@cli.command()
def fit(
    recipe: RecipeName,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FITTED.toml", help="Recipe to write.", readable=False)
    ],
    pairs: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Where points are and where they should be: a CSV file of x0,y0,x1,y1 in pixels (with a column curve "
            "for polylines), a .tps file of two specimens, or two .pts or .tps files, each after its own --pairs. "
            "Without --pairs and --masks: the recipe's own handles.",
            readable=False,
        ),
    ] = None,
    masks: Annotated[
        tuple[Path, Path] | None,
        typer.Option(
            metavar="FROM TO",
            help="Two pictures: the white area of FROM gets the outline of that of TO.",
            readable=False,
        ),
    ] = None,
    arrived: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write where the points arrive: .csv, .pts or .tps.", readable=False),
    ] = None,
    image: Annotated[
        Path | None, typer.Option("--image", "-i", help="Picture to use instead of the recipe's.", readable=False)
    ] = None,
    evaluations: Annotated[int, typer.Option(min=1, max=100_000, help="The most trial runs on a coarse grid.")] = 32,
    local: Annotated[
        float | None,
        typer.Option(
            min=0,
            max=1,
            help="0: handles push as a fluid does (default for points); 1: they move only what is under them "
            "(default for curves).",
        ),
    ] = None,
    time_limit: Annotated[
        float | None, typer.Option(min=0, help="Seconds after which to stop and write the best result so far.")
    ] = None,
    max_pixels: MaxPixels = 400_000_000,
    gpu: Gpu = None,
) -> None:
    """Find handles that bring points to given places, with the least work and without a fold.

    Ctrl+C stops and writes the best result so far. FITTED.toml is a recipe: `fluidwarp render FITTED.toml` plays it.
    Pairs that miss their places are named, with the distance left; the exit status is still 0.
    """
    from time import monotonic

    from app.progress import on_terminal
    from app.work.fit_job import FitJob
    from solver.gl.device import Device

    _check_output(output, arrived)
    job = FitJob(
        recipe, tuple(pairs or ()), masks, output, arrived=arrived, image=image, evaluations=evaluations, local=local,
        max_pixels=max_pixels,
    )  # fmt: skip
    job.check()
    _choose(gpu)
    until = None if time_limit is None else monotonic() + time_limit
    with on_terminal(output.name, None, at_once=None) as progress, Device.headless() as device:
        asked = progress.cancel
        progress.cancel = lambda: asked() or (until is not None and monotonic() >= until)
        try:
            found = job.perform(device, progress)
        except Cancelled:
            if asked():
                raise
            raise UserError(
                f"--time-limit {time_limit:g} has passed before anything was found; nothing is written, allow more"
            ) from None
    _tell(*found.notices, f"{output.name}: {found.told}")
    if asked():
        _fail("stopped; the best so far is written", INTERRUPTED)
    if found.stopped:
        _tell(f"--time-limit {time_limit:g} has passed; the best so far is written")


@cli.command()
def apply(
    map_: Annotated[
        Path,
        typer.Argument(
            metavar="MAP", help="Warp map (.exr .tif .flo .npy), or one for each frame (m.%04d.exr).", readable=False
        ),
    ],
    pictures: Annotated[
        list[Path],
        typer.Argument(
            metavar="PICTURE", help="Pictures, clips or numbered files (f.%04d.exr) to warp.", readable=False
        ),
    ],
    output: Output,
    kind: MapKind = None,
    grid: StGrid = None,
    overscan: MapOverscan = None,
    edges: Annotated[
        str, typer.Option(help="Beyond the edges: transparent, black, clamp, mirror or wrap.")
    ] = "transparent",
    size: Size = None,
    filter_: Filter = None,
    fps: Annotated[float | None, typer.Option(help="Frames per second of a picture's animation.")] = None,
    quality: Quality = None,
    frames: Frames = None,
    resume: Resume = False,
    codec: Codec = None,
    bits: Bits = None,
    dpi: Dpi = None,
    strip: Strip = False,
    max_pixels: MaxPixels = 400_000_000,
    jobs: Jobs = 1,
    cluster: Cluster = None,
    verbose: Verbose = False,
    gpu: Gpu = None,
) -> None:
    """Warp pictures, clips or numbered files by a warp map, made by fluidwarp or another program.

    If OUT has no ending, or there are several pictures, OUT is a folder for them, and each keeps its name.
    Or give a name for each, such as OUT/{name}-w.png.
    """
    from app.model.recipe import Recipe
    from app.work.apply_job import Application
    from app.work.jobs import Outputs
    from app.work.tasks import edited

    keys = {"output.size": size, "output.fps": fps, "output.quality": quality, "output.filter": filter_, "edges": edges}
    asked = edited(Recipe(), keys)
    order = Application(
        picture=pictures[0],
        outputs=Outputs(output, part=_part(frames), bits=bits, strip=strip, codec=codec, resume=resume, dpi=dpi),
        max_pixels=max_pixels,
        maps=_map_source(map_, kind, grid, overscan, max_pixels),
        edges=asked.edges,
        filter=asked.output.filter,
        size=asked.output.size,
        quality=asked.output.quality,
        fps=asked.output.fps,
    )
    _perform(order, pictures, jobs, cluster, gpu, verbose)


def _map_source(path: Path, kind: str | None, grid: str | None, overscan: int | None, max_pixels: int) -> MapSource:
    from app.work.apply_job import MapSource

    if kind not in (None, "st", "offsets"):
        raise UserError(f"--kind must be st or offsets, not {kind}")
    if grid not in (None, "centres", "corners", "pixels"):
        raise UserError(f"--grid must be centres, corners or pixels, not {grid}")
    return MapSource(path, kind, grid, overscan, max_pixels)


@cli.command()
def convert(
    map_: Annotated[
        Path,
        typer.Argument(
            metavar="MAP", help="Warp map (.exr .tif .flo .npy), or a sequence (m.%04d.exr).", readable=False
        ),
    ],
    output: Output,
    offsets: Annotated[bool, flag("--offsets", "Pixel offsets in OUT, instead of an ST map.")] = False,
    invert: Annotated[
        bool, flag("--invert", "Invert the map: where points go, instead of where they come from.")
    ] = False,
    kind: MapKind = None,
    grid: StGrid = None,
    overscan: MapOverscan = None,
    max_pixels: MaxPixels = 400_000_000,
    gpu: Gpu = None,
) -> None:
    """Write a warp map in another format."""
    from app.progress import on_terminal
    from app.work.apply_job import converted

    _check_output(output)
    source = _map_source(map_, kind, grid, overscan, max_pixels)
    _choose(gpu)
    with on_terminal(output.name, None) as progress:
        notices = converted(source, output, "offsets" if offsets else "st", invert, progress)
    _tell(*notices)


@cli.command()
def gallery(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder to write to.", readable=False)
    ] = Path("gallery"),
    strokes: Annotated[
        bool, flag("--strokes", "Render the retouching jobs and posters instead, painted with brush strokes.")
    ] = False,
    gpu: Gpu = None,
) -> None:
    """Render the figures of the paper and of the guide: results, animations and contact sheets."""
    _check_output(output)
    from app.gallery import figures, retouching
    from app.media.files import no_empty_folder
    from app.progress import on_terminal
    from solver.gl.device import Device

    _choose(gpu)
    with no_empty_folder(output), on_terminal("gallery", None) as progress, Device.headless() as device:
        measured = (retouching if strokes else figures).make(device, output, progress)
    for figure, numbers in measured.items():
        print(f"{figure}: {', '.join(f'{name} {number}' for name, number in numbers.items())}")


@cli.command()
def doctor() -> None:
    """Check OpenGL, the window and the video encoder, and say what to install."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from app.doctor import examine

    console = Console(width=None if sys.stdout.isatty() else sys.maxsize)  # a command to copy stays on its line
    table = Table(box=None, show_header=False, padding=(0, 1))
    failed = False
    for finding in examine():
        mark = "[green]ok[/]" if finding.is_well else "[red]missing[/]" if finding.vital else "[yellow]without[/]"
        mend = f"\n[dim]{escape(finding.mend)}[/]" if finding.mend else ""
        table.add_row(mark, finding.name, f"{escape(finding.said)}{mend}")
        failed |= finding.vital and not finding.is_well
    console.print(table)
    if failed:
        raise typer.Exit(1)


if __name__ == "__main__":
    main()
