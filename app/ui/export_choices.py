"""What can be chosen for an export from the window, and what is: kinds of file, presets, and all other settings."""

from __future__ import annotations

from dataclasses import dataclass

from app.media.formats import FORMATS
from app.work.session import Session


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


def holds_light(file: FileKind) -> bool:
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
FINER = (("As seen", 1), ("2 x", 2))


@dataclass
class Choices:
    """What is chosen for an export, but for its folder and the part of the time, which goes on growing with the work.

    Attributes:
        extent: width and height of the picture that it was chosen for, pixels.
        kind: PICTURE, ANIMATION or MAP.
        format: which of its kinds of file, for each of these.
        variant: which of the variants, for each kind of file.
        size: pixels along the longer side.
        quality: of kinds of file that have one.
        fps: frames a second of an animation.
        returns: an animation goes there and back again.
        dissolve: seconds in which its end dissolves into its beginning, if it does not return.
        filter: which of `FILTERS`.
        dpi: dots per inch noted in a picture; None is the picture's own.
        finer: which of `FINER`.
        forward: the map tells where the points of the original go.
        offsets: an EXR or TIFF map holds offsets in pixels.
        name: of the file, without its ending; None is the one that is proposed.
    """

    extent: tuple[int, int]
    kind: int
    format: list[int]
    variant: list[list[int]]
    size: int
    quality: int
    fps: float
    returns: bool
    dissolve: float
    filter: int
    dpi: float | None = None
    finer: int = 0
    forward: bool = False
    offsets: bool = False
    name: str | None = None

    @classmethod
    def of(cls, session: Session, last: str) -> Choices:
        """What the first export of some work begins with; `last` is what was exported last, as `told` says it."""
        picture, recipe = session.project.picture, session.recipe
        kind, formats = PICTURE, [0 for _ in KINDS]
        for number, (label, files) in enumerate(KINDS):
            for which, file in enumerate(files):
                if last == f"{label} {file.name}":
                    kind, formats[number] = number, which
        if session.project.clip is not None:
            kind = ANIMATION
        if picture.linear and not holds_light(PICTURES[formats[PICTURE]]):
            formats[PICTURE] = next(number for number, file in enumerate(PICTURES) if file.name == "EXR")
        return cls(
            extent=(picture.width, picture.height),
            kind=kind,
            format=formats,
            variant=[[0 for _ in files] for _, files in KINDS],
            size=max(picture.width, picture.height),
            quality=recipe.output.quality,
            fps=recipe.output.fps,
            returns=recipe.time.ping_pong,
            dissolve=recipe.time.dissolve,
            filter=[name for name, *_ in FILTERS].index(recipe.output.filter),
        )

    @property
    def file_kind(self) -> FileKind:
        return KINDS[self.kind][1][self.format[self.kind]]

    @property
    def how(self) -> Variant:
        return self.file_kind.variants[self.variant[self.kind][self.format[self.kind]]]

    @property
    def told(self) -> str:
        return f"{KINDS[self.kind][0]} {self.file_kind.name}"
