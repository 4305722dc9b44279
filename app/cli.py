"""The command line: `fluidwarp edit | render | apply | convert | gallery | doctor`."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Optional

import typer

from app.errors import Cancelled, UserError

if TYPE_CHECKING:
    from app.opening import Opened
    from app.recipe import Recipe

# Whatever is slow to import is imported where it is used: a command line has to answer at once.

INTERRUPTED = 130
cli = typer.Typer(
    name="fluidwarp",
    help="Warp pictures by pushing them about as a fluid of varying viscosity.",
    no_args_is_help=False,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> None:
    """Run the command line; what goes wrong ends in one message on stderr and a status that is not 0."""
    try:
        cli()
    except UserError as error:
        _fail(str(error), error.status)
    except Cancelled:
        _fail("cancelled; nothing was written", INTERRUPTED)
    except KeyboardInterrupt:
        _fail("interrupted", INTERRUPTED)
    except BrokenPipeError:
        # The reader has gone, as `| head` does; Python must not try to flush to it on its way out.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except MemoryError:
        _fail("there is not enough memory; try a smaller --size or --grid", 1)
    except Exception as error:
        if type(error).__name__ == "ContextError":
            _fail(f"{error}; `fluidwarp doctor` tells more", 1)
        if os.environ.get("FLUIDWARP_TRACEBACK"):
            raise
        words = str(error).strip().splitlines()
        said = f": {words[0]}" if words else ""
        _fail(f"this is a mistake in fluidwarp ({type(error).__name__}{said}); FLUIDWARP_TRACEBACK=1 shows where", 70)


def _fail(message: str, status: int) -> None:
    print(f"fluidwarp: {message}", file=sys.stderr)
    sys.exit(status)


Output = Annotated[Path, typer.Option("--output", "-o", metavar="OUT", help="What to write; its ending says how.")]


@cli.callback(invoke_without_command=True)
def start(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Say which version this is.")] = False,
) -> None:
    """Without a command, opens the editor."""
    if version:
        from importlib.metadata import version as installed

        print(f"fluidwarp {installed('fluidwarp')}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        edit(None)


@cli.command()
def edit(
    file: Annotated[Optional[Path], typer.Argument(help="A picture, a recipe or a project.")] = None,  # noqa: UP045
) -> None:
    """Open the editor: push the picture about with the mouse."""
    try:
        from app.ui.window import run
    except ImportError as error:
        raise UserError(f"the window cannot be loaded ({error}); `fluidwarp doctor` says what is missing", 2) from None
    run(file)


@cli.command()
def render(
    recipe: Annotated[
        str, typer.Argument(help="A recipe (.toml) or project, or the name of a recipe that comes with fluidwarp.")
    ],
    pictures: Annotated[Optional[list[Path]], typer.Argument(help="Pictures instead of the recipe's own.")] = None,  # noqa: UP045
    output: Output = Path("out.png"),
    image: Annotated[Optional[Path], typer.Option("--image", "-i", help="The picture to warp.")] = None,  # noqa: UP045
    stats: Annotated[Optional[Path], typer.Option(help="Write numbers about every frame, as JSON.")] = None,  # noqa: UP045
    map_: Annotated[Optional[Path], typer.Option("--map", help="Write the last frame's warp map (.exr ...).")] = None,  # noqa: UP045
    size: Annotated[Optional[int], typer.Option(help="Longer side of the result, in pixels.")] = None,  # noqa: UP045
    grid: Annotated[Optional[int], typer.Option(help="Cells along the longer side.")] = None,  # noqa: UP045
    solver: Annotated[Optional[str], typer.Option(help="mac or paper.")] = None,  # noqa: UP045
    duration: Annotated[Optional[float], typer.Option(help="Seconds to simulate.")] = None,  # noqa: UP045
    fps: Annotated[Optional[float], typer.Option(help="Frames per second of an animation.")] = None,  # noqa: UP045
    quality: Annotated[Optional[int], typer.Option(help="1-100, of JPEG, WebP and video.")] = None,  # noqa: UP045
    start: Annotated[Optional[float], typer.Option("--from", help="First second of an animation.")] = None,  # noqa: UP045
    end: Annotated[Optional[float], typer.Option("--to", help="Last second.")] = None,  # noqa: UP045
) -> None:
    """Warp a picture by a recipe: OUT.png is the picture at the end, OUT.mp4 or OUT.gif the animation, OUT.%04d.png its
    frames.

    With several pictures, write {name} where OUT shall have the name of each.
    """
    from app.opening import open_recipe

    loaded = open_recipe(recipe)
    changed = {
        "fluid": {"grid": grid, "solver": solver},
        "output": {"size": size, "fps": fps, "quality": quality},
        "time": {"start": start, "end": end},
    }
    asked = _with_options(loaded.recipe, changed, {"duration": duration})
    wanted = [*([image] if image else []), *(pictures or [])] or [None]
    if len(wanted) > 1 and "{name}" not in str(output):
        raise UserError(f"{len(wanted)} pictures cannot all become {output}; write for example out/{{name}}.png")
    for picture in wanted:
        target = Path(str(output).replace("{name}", picture.stem)) if picture else output
        _render_one(asked, loaded, picture, target, stats, map_)


def _render_one(
    recipe: Recipe, loaded: Opened, picture: Path | None, target: Path, stats: Path | None, map_: Path | None
) -> None:
    from app.export import Job, run
    from app.progress import on_terminal
    from solver.context import Device

    job = Job(recipe, loaded.picture(picture), loaded.folder, target, stats, map_)
    job.check()
    with on_terminal(target.name, recipe.ticks) as progress, Device.headless() as device:
        report = run(device, job, progress)
    for notice in (*report.notices, *([report.verdict] if report.verdict else [])):
        print(f"fluidwarp: {notice}", file=sys.stderr)


def _with_options(recipe: Recipe, changed: dict[str, dict[str, Any]], single: dict[str, Any]) -> Recipe:
    """The recipe with the options that were given instead of its own; `changed` are keys of its tables."""
    parts = {name: value for name, value in single.items() if value is not None}
    for key, options in changed.items():
        given = {name: value for name, value in options.items() if value is not None}
        if given:
            parts[key] = getattr(recipe, key).model_copy(update=given)
    return recipe.edited(**parts).checked("the command line") if parts else recipe


@cli.command()
def apply(
    map_: Annotated[Path, typer.Argument(metavar="MAP", help="A warp map: .exr, .tif, .flo or .npy.")],
    picture: Annotated[Path, typer.Argument(help="The picture to warp by it.")],
    output: Output,
    edges: Annotated[str, typer.Option(help="transparent, black, clamp, mirror or wrap.")] = "transparent",
    size: Annotated[Optional[int], typer.Option(help="Longer side of the result, in pixels.")] = None,  # noqa: UP045
) -> None:
    """Warp a picture by a map that was made before, or elsewhere."""
    from app.export import apply_map
    from app.files import writable
    from app.maps import read_map
    from app.pictures import picture_format, read_picture, write_picture
    from app.recipe import Recipe
    from solver.context import Device

    picture_format(output)
    writable(output)
    wanted = _with_options(Recipe(), {"output": {"size": size}}, {"edges": edges})
    given, source = read_map(map_), read_picture(picture)
    with Device.headless() as device:
        write_picture(output, apply_map(device, given, source, wanted))


@cli.command()
def convert(
    map_: Annotated[Path, typer.Argument(metavar="MAP", help="A warp map: .exr, .tif, .flo or .npy.")],
    output: Output,
    offsets: Annotated[bool, typer.Option(help="Pixel offsets in an EXR or TIFF, instead of an ST map.")] = False,
) -> None:
    """Write a warp map in another format."""
    from app.maps import read_map, write_map

    write_map(output, read_map(map_), "offsets" if offsets else "st")


@cli.command()
def gallery(
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="The folder to write to.")] = Path(
        "gallery"
    ),
) -> None:
    """Make the paper's figures again: results, animations and contact sheets."""
    from app.gallery import make
    from app.progress import on_terminal
    from solver.context import Device

    with on_terminal("gallery", None) as progress, Device.headless() as device:
        measured = make(device, output, progress)
    for figure, numbers in measured.items():
        print(f"{figure}: {', '.join(f'{name} {number}' for name, number in numbers.items())}")


@cli.command()
def doctor() -> None:
    """Say which OpenGL is there, whether a window can be opened, and what to install otherwise."""
    from rich.console import Console
    from rich.table import Table

    from app.doctor import examine

    console = Console()
    table = Table(box=None, show_header=False, padding=(0, 1))
    failed = False
    for finding in examine():
        mark = "[green]ok[/]" if finding.is_well else "[red]missing[/]" if finding.vital else "[yellow]without[/]"
        mend = f"\n[dim]{finding.mend}[/]" if finding.mend else ""
        table.add_row(mark, finding.name, f"{finding.said}{mend}")
        failed |= finding.vital and not finding.is_well
    console.print(table)
    if failed:
        raise typer.Exit(1)
