"""Whatever a still holds is in what is made of it, or is told to be lost: never neither, never both, for every pair."""

from __future__ import annotations

import re
import struct
import subprocess
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from itertools import product
from pathlib import Path
from typing import Any

import cv2
import imagecodecs
import numpy as np
import OpenEXR
import pytest
import tifffile
from PIL import ExifTags, Image, ImageCms
from PIL.PngImagePlugin import PngInfo

from app.errors import UserError
from app.media import ffmpeg
from app.media.displacement import Displacement
from app.media.formats import ONLY_READ, TABLE
from app.media.holding import unheld
from app.media.maps import write_map
from app.media.pictures import read_picture, write_picture
from app.media.source import open_source
from app.model.picture import Picture
from app.progress import Progress
from app.work.apply_job import Application, MapSource
from app.work.jobs import Outputs
from app.work.tasks import Piece, Task
from solver.gl.device import Device
from support.commands import Run

WIDTH, HEIGHT, ROWS = 80, 64, 22
RECIPE = 'picture = "p.png"\nduration = 0.1\n[output]\nfps = 10\n[fluid]\ngrid = 16\n'
RNG = np.random.default_rng
XMP = b'<x:xmpmeta xmlns:x="adobe:ns:meta/"><title>A cup</title></x:xmpmeta>'
ICC = (
    ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB"))
    .tobytes()
    .replace("sRGB".encode("utf-16-be"), "Wide".encode("utf-16-be"))
)
PQ = bytes([9, 16, 0, 1])
P3 = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329)
STILLS = [
    *((ending, None) for kind in TABLE if kind.write for ending in kind.endings[:1]),
    *((".png", 8), (".tif", 8), (".tif", 16), (".exr", 16)),
]
MOVING = [".mkv", ".mov", ".mp4", ".webm", ".gif", ".apng", "%d.png", "%d.exr"]


# Independent readers ------------------------------------------------------------------------------------------------


@dataclass
class Seen:
    """What another reader finds in a file.

    values: (h, w, c), of whole numbers from 0 to 1 in their curve, of floats light.
    things: all else, by name.
    """

    values: np.ndarray
    is_float: bool = False
    things: dict[str, Any] = field(default_factory=dict)
    bits: int | None = None  # of a video, whose values are not those that were written


def seen(path: Path) -> Seen:
    """Of a sequence its first file."""
    if "%d" in path.name:
        path = path.with_name(path.name.replace("%d", "0"))
    if path.suffix == ".exr":
        return _exr(path)
    if path.suffix == ".tif":
        return _tiff(path)
    if path.suffix in (".mkv", ".mov", ".mp4", ".webm", ".gif", ".apng"):
        return _frame(path)
    with Image.open(path) as image:
        image.load()
        things = _pillow(image)
        pixels = np.asarray(image.convert("RGBA" if image.has_transparency_data else "RGB"))
    if path.suffix == ".png":
        deep = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert deep is not None
        pixels = deep[..., None] if deep.ndim == 2 else deep[..., [2, 1, 0, 3][: deep.shape[2]]]
        things |= {f"chunk {kind}": data for kind, data in _chunks(path).items() if kind in ("cICP", "gAMA")}
    return Seen(pixels / (65535 if pixels.dtype == np.uint16 else 255), things=things)


def _pillow(image: Image.Image) -> dict[str, Any]:
    things: dict[str, Any] = _tags(image.getexif())
    if icc := image.info.get("icc_profile"):
        things["profile"] = icc
    if b"A cup" in (image.info.get("xmp") or image.info.get("XML:com.adobe.xmp", "").encode()):
        things["XMP"] = True
    texts = {**getattr(image, "text", {})}
    if comment := image.info.get("comment"):
        texts["Comment"] = comment.decode()
    texts.pop("XML:com.adobe.xmp", None)
    return things | {f"text {name}": str(text) for name, text in texts.items()}


def _tags(exif: Image.Exif) -> dict[str, Any]:
    all_of_them = {**exif, **exif.get_ifd(0x8769)} | ({0x8825: exif.get_ifd(0x8825)} if 0x8825 in exif else {})
    names = ("Artist", "Make", "Rating", "DateTimeOriginal", "GPSInfo", "ImageDescription")
    return {
        f"tag {ExifTags.TAGS[code]}": value for code, value in all_of_them.items() if ExifTags.TAGS.get(code) in names
    }


def _chunks(path: Path) -> dict[str, bytes]:
    data, at, found = path.read_bytes(), 8, {}
    while at < len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        found[data[at + 4 : at + 8].decode("latin-1")] = data[at + 8 : at + 8 + length]
        at += 12 + length
    return found


def _tiff(path: Path) -> Seen:
    with tifffile.TiffFile(path) as tiff:
        page = tiff.pages.first
        pixels = page.asarray()
        things: dict[str, Any] = {"profile": bytes(page.tags[34675].value)} if 34675 in page.tags else {}
        if 700 in page.tags and b"A cup" in bytes(page.tags[700].value):
            things["XMP"] = True
        further = {**{tag.code: tag.value for tag in page.tags}}
        inner = further.get(0x8769)
        if page.extrasamples == (tifffile.EXTRASAMPLE.ASSOCALPHA,):
            things["premultiplied"] = True
    named = {315: "Artist", 271: "Make", 270: "ImageDescription", 0x4746: "Rating"}
    things |= {f"tag {name}": further[code] for code, name in named.items() if code in further}
    if isinstance(inner, Mapping) and "DateTimeOriginal" in inner:
        things["tag DateTimeOriginal"] = inner["DateTimeOriginal"]
    if 0x8825 in further:
        things["tag GPSInfo"] = further[0x8825]
    pixels = pixels if pixels.ndim == 3 else pixels[..., None]
    if pixels.dtype.kind == "f":
        return Seen(pixels.astype(np.float64), True, things)
    return Seen(pixels / np.iinfo(pixels.dtype).max, things=things)


def _exr(path: Path) -> Seen:
    (part, *_) = OpenEXR.File(str(path), separate_channels=True).parts
    header = part.header
    planes = {name: np.asarray(channel.pixels) for name, channel in part.channels.items()}
    names = [name for name in "RGBAY" if name in planes]
    (left, top), (right, bottom) = header["displayWindow"]
    (x, y), _ = header["dataWindow"]
    inside = slice(top - y, bottom - y + 1), slice(left - x, right - x + 1)
    values = np.stack([planes[name][inside] for name in names], axis=-1).astype(np.float64)
    things: dict[str, Any] = {f"channel {name}": True for name in planes if name not in names}
    if "chromaticities" in header:
        things["primaries"] = tuple(round(float(value), 3) for value in header["chromaticities"])
    things |= {f"text {name}": value for name, value in header.items() if isinstance(value, str) and name != "type"}
    things |= {f"attribute {name}": value for name, value in header.items() if name in ("framesPerSecond", "take")}
    things["premultiplied"] = True
    if planes[names[0]].shape != values.shape[:2]:
        things["overscan"] = True
    if left or top:
        things["origin"] = int(left), int(top)
    return Seen(values, True, things)


def _frame(path: Path) -> Seen:
    """The first frame of an animation, by ffmpeg."""
    decoder = ["-c:v", "libvpx-vp9"] if path.suffix == ".webm" else []
    command = [ffmpeg.executable(), *decoder, "-i", str(path), "-frames:v", "1", "-pix_fmt", "rgba64be"]
    done = subprocess.run([*command, "-c:v", "png", "-f", "image2pipe", "-"], check=True, capture_output=True)
    pixels = cv2.imdecode(np.frombuffer(done.stdout, np.uint8), cv2.IMREAD_UNCHANGED)
    assert pixels is not None
    told = re.search(r"Video: .*", done.stderr.decode())
    assert told
    deep = re.search(r"(\d+)le", told[0])
    things = {"chunk cICP": PQ} if "bt2020" in told[0] and "smpte2084" in told[0] else {}
    bits = 10 if "prores" in told[0] else int(deep[1]) if deep else 8  # of 12 that are read, 10 were written
    return Seen(pixels[..., [2, 1, 0, 3]] / 65535, things=things, bits=bits)


# What a still may hold, and how its loss is told ----------------------------------------------------------------------

Kept = Callable[[Seen], bool]


@dataclass
class Thing:
    """told: a pattern of the words that tell its loss."""

    told: str
    kept: Kept


def levels(least: int, bits: int = 16) -> Thing:
    """So many different values of red, below the rows where other things are; of a video, so many bits."""
    told = r"holds \S+ bits? .*and not the picture's|holds 16-bit floats and not|bits a channel become"

    def kept(out: Seen) -> bool:
        return len(np.unique(out.values[ROWS:, :, 0])) >= least if out.bits is None else out.bits >= bits

    return Thing(told, kept)


ABOVE = Thing(r"above 1\b", lambda out: bool((out.values[..., :3] > 1.5).any()))
BELOW = Thing(r"below 0\b", lambda out: bool((out.values[..., :3] < -0.01).any()))
NOWHERE = Thing(r"NaN", lambda out: bool(np.isnan(out.values).any()))
HUGE = Thing(r"beyond 65504|above 1\b", lambda out: bool((out.values[..., :3] > 65504).any()))
ALPHA = Thing(
    r"no alpha, and is laid over black", lambda out: out.values.shape[2] == 4 and out.values[..., 3].min() < 1
)
PARTIAL = Thing(
    r"no alpha|half-transparent",
    lambda out: out.values.shape[2] == 4 and bool(((out.values[..., 3] > 0.1) & (out.values[..., 3] < 0.9)).any()),
)
UNSEEN = Thing(
    r"no colours where alpha is 0|no alpha",
    lambda out: out.values.shape[2] == 4 and bool((out.values[..., :3][out.values[..., 3] == 0] > 0.1).any()),
)


GLOW = Thing(
    r"no colours where alpha is 0",
    lambda out: "premultiplied" in out.things and bool((out.values[..., :3][out.values[..., 3] == 0] > 0.1).any()),
)


def named(name: str, value: Any = None, told: str | None = None) -> Thing:
    """Something that has a name, with this value where one is given."""
    word = told or rf"\b{re.escape(name.split(' ', 1)[-1])}\b"

    def kept(out: Seen) -> bool:
        return name in out.things and (value is None or out.things[name] == value)

    return Thing(word, kept)


def always(told: str) -> Thing:
    """What no still holds."""
    return Thing(told, lambda out: False)


PROFILE = named("profile", ICC, "colour profile")
GONE_XMP = named("XMP")
ARTIST, MAKE, RATING = named("tag Artist", "A. Painter"), named("tag Make", "A camera"), named("tag Rating", 4)
DATE = named("tag DateTimeOriginal", None, r"EXIF .*(DateTimeOriginal|and \d more)")
GPS = named("tag GPSInfo", None, r"EXIF .*(GPSInfo|and \d more)")
CAMERA = {"artist": ARTIST, "make": MAKE, "rating": RATING, "date": DATE, "gps": GPS}
PAGES = always(r"only the first is used")
SAYS_HOW = r"(?:mixed as if sRGB|treated as sRGB)"  # told of what is kept, too

# Sources, by other writers ------------------------------------------------------------------------------------------


def smooth() -> np.ndarray:
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    return np.stack([(40 + x) % 256, (60 + y) % 256, (x + y + 50) % 256], axis=-1).astype(np.uint8)


def deep(seed: int = 0) -> np.ndarray:
    return RNG(seed).integers(3000, 65000, (HEIGHT, WIDTH, 3)).astype(np.uint16)


def light(kind: Any = np.float32) -> np.ndarray:
    return RNG(2).uniform(0.05, 1, (HEIGHT, WIDTH, 3)).astype(kind)


def reds(pixels: np.ndarray) -> Thing:
    return levels(len(np.unique(pixels[ROWS:, :, 0])), {"f2": 11, "f4": 24}.get(pixels.dtype.str[1:], 16))


def with_alpha(pixels: np.ndarray, whole: bool = False) -> np.ndarray:
    most = 1 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max
    alpha = np.full((HEIGHT, WIDTH, 1), most, pixels.dtype)
    alpha[:8] = 0
    alpha[8:16] = 0 if whole else most // 2 if most > 1 else 0.5
    return np.concatenate([pixels, alpha], axis=2)


def exif() -> Image.Exif:
    made = Image.Exif()
    made[0x010F], made[0x013B], made[0x4746], made[0x0112] = "A camera", "A. Painter", 4, 1
    made.get_ifd(0x8769)[0x9003] = "2020:01:02 03:04:05"
    made.get_ifd(0x8825)[1] = "N"
    return made


def chunked(path: Path, **chunks: bytes) -> None:
    plain = path.read_bytes()
    added = b"".join(
        struct.pack(">I", len(data)) + name.encode() + data + struct.pack(">I", zlib.crc32(name.encode() + data))
        for name, data in chunks.items()
    )
    path.write_bytes(plain[:33] + added + plain[33:])


def exr(path: Path, pixels: np.ndarray, header: dict[str, Any], **layers: np.ndarray) -> None:
    names = "RGBA"[: pixels.shape[2]]
    planes = {name: np.ascontiguousarray(pixels[..., place]) for place, name in enumerate(names)} | layers
    with path.open("wb") as stream:
        OpenEXR.File({"type": OpenEXR.scanlineimage, **header}, planes).write(stream)


Made = Mapping[str, Thing]
SOURCES: dict[str, Callable[[Path], Made]] = {}


def source(ending: str) -> Callable[[Callable[[Path], Made]], Callable[[Path], Made]]:
    def add(make: Callable[[Path], Made]) -> Callable[[Path], Made]:
        SOURCES[f"{make.__name__}{ending}"] = make
        return make

    return add


@source(".png")
def plain(path: Path) -> Made:
    Image.fromarray(smooth()).save(path)
    return {}


@source(".jpg")
def photo(path: Path) -> Made:
    Image.fromarray(smooth()).save(path, exif=exif(), icc_profile=ICC, xmp=XMP, comment="seen by me", dpi=(300, 300))
    return CAMERA | {"profile": PROFILE, "xmp": GONE_XMP, "comment": named("text Comment", "seen by me")}


@source(".jpg")
def unadorned(path: Path) -> Made:
    cv2.imwrite(str(path), smooth())
    return {}


@source(".jpg")
def press(path: Path) -> Made:
    Image.fromarray(smooth()).save(path)
    data = path.read_bytes()
    iptc = b"Photoshop 3.0\0" + b"8BIM\x04\x04\0\0\0\0\0\x08\x1c\x02\x78\0\x03cup"
    path.write_bytes(data[:2] + b"\xff\xed" + struct.pack(">H", len(iptc) + 2) + iptc + data[2:])
    return {"iptc": always(r"APP13 Photoshop 3.0 \(IPTC\)")}


@source(".png")
def adorned(path: Path) -> Made:
    info = PngInfo()
    info.add_text("Author", "A. Painter")
    info.add_itxt("Title", "Eine Tasse, hübsch")
    info.add_itxt("XML:com.adobe.xmp", XMP.decode())
    Image.fromarray(with_alpha(smooth())).save(path, pnginfo=info, exif=exif(), icc_profile=ICC, dpi=(300, 300))
    texts = {"author": named("text Author", "A. Painter"), "title": named("text Title", "Eine Tasse, hübsch")}
    return CAMERA | texts | {"profile": PROFILE, "xmp": GONE_XMP, "alpha": PARTIAL, "unseen": UNSEEN}


@source(".png")
def deep_png(path: Path) -> Made:
    pixels = with_alpha(deep())
    cv2.imwrite(str(path), pixels[..., [2, 1, 0, 3]])
    return {"levels": reds(pixels), "alpha": PARTIAL, "unseen": UNSEEN}


@source(".png")
def opaque(path: Path) -> Made:
    """An alpha that hides nothing is none."""
    Image.fromarray(np.dstack([smooth(), np.full((HEIGHT, WIDTH), 255, np.uint8)])).save(path)
    return {}


@source(".png")
def shallow(path: Path) -> Made:
    """Of 16 bits, in which there are no more than 8."""
    cv2.imwrite(str(path), smooth().astype(np.uint16) * 257)
    return {}


@source(".png")
def hdr(path: Path) -> Made:
    pixels = deep(3)
    cv2.imwrite(str(path), pixels[..., ::-1])
    chunked(path, cICP=PQ)
    return {"cicp": named("chunk cICP", PQ, "BT.2020 PQ"), "levels": reds(pixels)}


@source(".png")
def linear(path: Path) -> Made:
    Image.fromarray(smooth()).save(path)
    chunked(path, gAMA=struct.pack(">I", 100000))
    return {"gamma": named("chunk gAMA", None, r"cannot tell the picture's gamma of 1 \(gAMA\)")}


@source(".png")
def odd_texts(path: Path) -> Made:
    """Names that mean something else in an EXR, and more than a JPEG holds."""
    info = PngInfo()
    for name in ("channels", "screenWindowWidth", "name"):
        info.add_text(name, "a text")
    info.add_text("Comment", "long" * 20000)
    Image.fromarray(smooth()).save(path, pnginfo=info)
    names = ("channels", "screenWindowWidth", "name", "Comment")
    return {name: named(f"text {name}", None if name != "Comment" else "long" * 20000) for name in names}


@source(".png")
def long_exif(path: Path) -> Made:
    made = exif()
    made[0x010E] = "long" * 20000
    info = PngInfo()
    info.add_itxt("XML:com.adobe.xmp", (XMP + b" " * 70000).decode())
    Image.fromarray(smooth()).save(path, pnginfo=info, exif=made)
    return CAMERA | {
        "description": named("tag ImageDescription", "long" * 20000, r"EXIF .*ImageDescription"),
        "xmp": GONE_XMP,
    }


@source(".png")
def animated_png(path: Path) -> Made:
    further = [Image.fromarray(np.roll(smooth(), shift, 1)) for shift in (1, 2)]
    Image.fromarray(smooth()).save(path, save_all=True, append_images=further)
    return {"pages": PAGES}


@source(".exr")
def marked_exr(path: Path) -> Made:
    channels = {name: OpenEXR.Channel(name, smooth()[..., 0] / np.float32(255), 1, 1, name == "R") for name in "RGB"}
    with path.open("wb") as stream:
        OpenEXR.File({"type": OpenEXR.scanlineimage}, channels).write(stream)
    return {"mark": always("its mark pLinear of channel R is not kept")}


@source(".gif")
def gif_of_wide_pixels(path: Path) -> Made:
    Image.fromarray(smooth()).save(path)
    data = bytearray(path.read_bytes())
    data[12] = 113
    path.write_bytes(data)
    return {"shape": always(r"the shape of its pixels \(2:1\) is not kept")}


@source(".gif")
def animated_gif(path: Path) -> Made:
    further = [Image.fromarray(np.roll(smooth(), shift, 1)) for shift in (1, 2)]
    Image.fromarray(smooth()).save(path, save_all=True, append_images=further, comment="seen by me")
    return {"pages": PAGES, "comment": named("text Comment", "seen by me")}


@source(".webp")
def animated_webp(path: Path) -> Made:
    further = [Image.fromarray(np.roll(smooth(), shift, 1)) for shift in (1, 2)]
    Image.fromarray(smooth()).save(path, save_all=True, append_images=further, lossless=True)
    return {"pages": PAGES}


@source(".webp")
def adorned_webp(path: Path) -> Made:
    made = exif()
    options = {"exif": made, "icc_profile": ICC, "xmp": XMP, "lossless": True, "exact": True}
    Image.fromarray(with_alpha(smooth())).save(path, **options)
    return CAMERA | {"profile": PROFILE, "xmp": GONE_XMP, "alpha": PARTIAL, "unseen": UNSEEN}


@source(".avif")
def deep_avif(path: Path) -> Made:
    pixels = (deep() >> 6).astype(np.uint16)
    path.write_bytes(imagecodecs.avif_encode(pixels, level=100, bitspersample=10, matrix=0))
    return {"levels": levels(300, 10)}


@source(".avif")
def hdr_avif(path: Path) -> Made:
    pixels = (deep() >> 6).astype(np.uint16)
    path.write_bytes(imagecodecs.avif_encode(pixels, level=100, bitspersample=10, primaries=9, transfer=16, matrix=0))
    return {"cicp": named("chunk cICP", PQ, "BT.2020 PQ"), "levels": levels(300, 10)}


@source(".tif")
def deep_tiff(path: Path) -> Made:
    pixels = deep(5)
    texts = [(315, "s", 0, "A. Painter", True), (271, "s", 0, "A camera", True), (700, "B", len(XMP), XMP, True)]
    tifffile.imwrite(
        path, pixels, photometric="rgb", iccprofile=ICC, extratags=texts, description="A cup", metadata=None
    )
    described = named("tag ImageDescription", "A cup")
    return {
        "levels": reds(pixels),
        "artist": ARTIST,
        "make": MAKE,
        "text": described,
        "profile": PROFILE,
        "xmp": GONE_XMP,
    }


@source(".tif")
def big_tiff(path: Path) -> Made:
    texts = [(315, "s", 0, "A. Painter", True)]
    tifffile.imwrite(path, smooth(), bigtiff=True, photometric="rgb", extratags=texts, metadata=None)
    return {"artist": ARTIST}


@source(".tif")
def bare_big_tiff(path: Path) -> Made:
    tifffile.imwrite(path, smooth(), bigtiff=True, photometric="rgb", metadata=None, software=False)
    return {}


@source(".tif")
def damaged_profile(path: Path) -> Made:
    tifffile.imwrite(path, smooth(), photometric="rgb", iccprofile=b"damaged" * 30, metadata=None)
    return {"profile": named("profile", b"damaged" * 30, r"colour profile \(damaged\)")}


@source(".tif")
def floats(path: Path) -> Made:
    pixels = light()
    pixels[0, :8], pixels[1, :8], pixels[2, :8], pixels[3, :8] = 3, -0.5, np.nan, np.inf
    tifffile.imwrite(path, pixels, photometric="rgb", metadata=None, software=False)
    return {"levels": reds(light()), "above": ABOVE, "below": BELOW, "nan": NOWHERE}


@source(".tif")
def halves(path: Path) -> Made:
    pixels = light(np.float16)
    tifffile.imwrite(path, pixels, photometric="rgb", metadata=None, software=False)
    return {"levels": reds(pixels)}


@source(".tif")
def pages(path: Path) -> Made:
    with tifffile.TiffWriter(path) as writer:
        for shift in range(3):
            writer.write(np.roll(smooth(), shift, 1), photometric="rgb", metadata=None)
    return {"pages": PAGES}


@source(".tif")
def glow(path: Path) -> Made:
    """Premultiplied, with light where alpha is 0."""
    tifffile.imwrite(
        path, with_alpha(smooth()), photometric="rgb", extrasamples=["assocalpha"], metadata=None, software=False
    )
    return {"alpha": PARTIAL, "glow": GLOW}


@source(".exr")
def shot(path: Path) -> Made:
    pixels = with_alpha(light(np.float16))
    pixels[20, :4] = 7.5
    window = {
        "dataWindow": (np.array([-2, -2], np.int32), np.array([WIDTH - 3, HEIGHT - 3], np.int32)),
        "displayWindow": (np.array([0, 0], np.int32), np.array([WIDTH - 5, HEIGHT - 5], np.int32)),
    }
    told = {"chromaticities": P3, "owner": "A. Painter", "take": 7}
    depth = np.ones((HEIGHT, WIDTH), np.float32)
    exr(path, pixels, window | told, Z=depth)
    return {
        "levels": reds(pixels[2:-2, 2:-2]), "above": ABOVE, "alpha": PARTIAL, "glow": GLOW,
        "overscan": named("overscan"), "primaries": named("primaries"), "owner": named("text owner", "A. Painter"),
        "take": named("attribute take", 7), "Z": named("channel Z"),
    }  # fmt: skip


@source(".exr")
def lights(path: Path) -> Made:
    pixels = light()
    pixels[0, :8], pixels[1, :8], pixels[2, :8] = 1e6, -0.5, np.nan
    window = {"displayWindow": (np.array([10, 20], np.int32), np.array([9 + WIDTH, 19 + HEIGHT], np.int32))}
    window["dataWindow"] = window["displayWindow"]
    exr(path, pixels, window)
    begins = named("origin", (10, 20), "begins at 0, 0")
    return {"levels": reds(light()), "huge": HUGE, "below": BELOW, "nan": NOWHERE, "origin": begins}


@source(".exr")
def mask(path: Path) -> Made:
    """Floats that any depth has."""
    exr(path, RNG(7).integers(0, 2, (HEIGHT, WIDTH, 3)).astype(np.float32), {})
    return {}


@source(".exr")
def counts(path: Path) -> Made:
    exr(path, RNG(0).integers(0, 3, (HEIGHT, WIDTH, 3)).astype(np.uint32), {})
    return {"uint": always(r"whole numbers \(uint\), and are taken for light"), "above": ABOVE}


@source(".bmp")
def bitmap(path: Path) -> Made:
    Image.fromarray(smooth()).save(path)
    return {}


@source(".jp2")
def deep_jp2(path: Path) -> Made:
    path.write_bytes(imagecodecs.jpeg2k_encode(deep(), level=0))
    return {"levels": always("its 16 bits a channel become 8")}


@source(".jp2")
def profiled_jp2(path: Path) -> Made:
    path.write_bytes(imagecodecs.jpeg2k_encode(smooth(), level=0))
    data = path.read_bytes()
    colours = b"colr\2\0\0" + ICC
    box = struct.pack(">I", len(colours) + 4) + colours
    usual = data.index(b"\0\0\0\x0fcolr")
    head = data.index(b"jp2h") - 4
    size = int.from_bytes(data[head : head + 4], "big") + len(box) - 15
    uuid = struct.pack(">I", 8 + 16 + len(XMP)) + b"uuid" + bytes(16) + XMP
    inner = data[head + 4 : usual] + box + data[usual + 15 :]
    path.write_bytes(data[:head] + struct.pack(">I", size) + inner + uuid)
    return {"profile": always("a colour profile"), "xmp": always(r"box.* uuid")}


@source(".sgi")
def deep_sgi(path: Path) -> Made:
    head = struct.pack(">HBBHHHHII", 474, 0, 2, 3, WIDTH, HEIGHT, 3, 0, 65535).ljust(512, b"\0")
    path.write_bytes(head + deep().transpose(2, 0, 1)[:, ::-1].astype(">u2").tobytes())
    return {"levels": always("its 16 bits a channel become 8")}


@source(".tga")
def noted_tga(path: Path) -> Made:
    Image.fromarray(smooth()).save(path, id_section=b"seen by me")  # of ten letters, as which a PCX begins
    return {"text": always("its text is not kept")}


@source(".ico")
def icons(path: Path) -> Made:
    Image.fromarray(smooth()[:64, :64]).save(path, sizes=[(16, 16), (64, 64)])
    return {"sizes": always("only the largest is used")}


# The property -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("kept")


@cache
def made(name: str, folder: Path) -> tuple[Path, Made]:
    (folder / "still.toml").write_text(RECIPE)
    path = folder / name
    return path, SOURCES[name](path)


def outcome_of(device: Device, piece: Piece) -> tuple[list[str], Seen | None]:
    """What is told of what is made of a picture that nothing moves, and what is in it; None where it is refused."""
    try:
        said = list(piece.perform(lambda: device, Progress()).notices)
    except UserError as error:
        return [str(error)], None
    assert piece.outputs.file is not None
    return said, seen(piece.outputs.file)


def rendered(device: Device, folder: Path, path: Path, outputs: Outputs) -> tuple[list[str], Seen | None]:
    """See `outcome_of`."""
    recipe = folder / "still.toml"
    return outcome_of(device, Task(recipe=str(recipe), edits={}, picture=path, outputs=outputs))


def is_all_kept_or_told(things: Made, said: list[str], found: Seen | None) -> bool:
    """False where it is refused, for something that it could not tell."""
    lines = "\n".join(said)
    told = {key for key, thing in things.items() if re.search(thing.told, re.sub(rf".*{SAYS_HOW}.*", "", lines))}
    kept = {key for key, thing in things.items() if found is not None and thing.kept(found)}
    if found is None:
        assert "Cannot write" in lines
        assert told  # what it is refused for
        return False
    assert not told & kept, (told & kept, lines)
    assert told | kept == set(things), (set(things) - told - kept, lines)
    assert len(said) <= 2, said
    if kept == set(things):
        assert not re.sub(rf".*{SAYS_HOW}.*", "", lines), lines
    return True


def check_pair(device: Device, folder: Path, name: str, output: Path, bits: int | None, is_moving: bool) -> None:
    path, things = made(name, folder)
    said, found = rendered(device, folder, path, Outputs(output, bits=bits, animated=is_moving, recorded=False))
    lines = "\n".join(said)
    if not is_all_kept_or_told(things, said, found):
        return
    better = re.search(r"write (\.\w+) to keep", lines)
    if better is not None:
        lost = {key for key in things if re.search(things[key].told, said[-1])}
        other = output.with_name(f"better-{output.stem}{better[1]}")
        _, held = rendered(device, folder, path, Outputs(other, animated=is_moving, recorded=False))
        assert held is not None
        assert {key for key in lost if not things[key].kept(held)} == set(), (better[1], lines)


@pytest.mark.parametrize("name", SOURCES)
def test_a_still_keeps_what_it_has_or_it_is_told(device: Device, folder: Path, name: str) -> None:
    for ending, bits in STILLS:
        output = folder / f"{name}-{bits}{ending}"
        check_pair(device, folder, name, output, bits, False)


@pytest.mark.parametrize("name", SOURCES)
def test_a_still_keeps_what_it_has_or_it_is_told_whichever_way_it_is_warped(
    device: Device, folder: Path, name: str
) -> None:
    """By a recipe or a map, in its own size or another: beyond the display window not all of them warp it."""
    path, things = made(name, folder)
    picture = open_source(path).picture
    nothing = np.zeros((picture.height, picture.width, 2), np.float32)
    for forward in (False, True):
        write_map(folder / f"{forward}.exr", Displacement(nothing, 0, forward))
    for number, (way, size) in enumerate(product(("recipe", "False.exr", "True.exr"), (None, 2 * picture.width))):
        outputs = Outputs(folder / f"{name}-{number}.exr")
        if way == "recipe":
            edits = {"output.size": size}
            piece = Task(recipe=str(folder / "still.toml"), edits=edits, picture=path, outputs=outputs)
        else:
            piece = Application(maps=MapSource(folder / way), picture=path, outputs=outputs, size=size)
        said, found = outcome_of(device, piece)
        assert found is None or found.values.shape[1] == (size or picture.width)
        is_all_kept_or_told(things, said, found)


MOVED = [
    name for name in SOURCES if name.split(".")[0] not in ("animated_png", "animated_gif", "animated_webp", "pages")
]


@pytest.mark.parametrize("name", MOVED)
def test_an_animation_of_a_still_keeps_what_it_has_or_it_is_told(device: Device, folder: Path, name: str) -> None:
    for ending in MOVING:
        output = folder / (f"{name}-{ending}" if ending.startswith("%") else f"{name}{ending}")
        check_pair(device, folder, name, output, None, True)


def test_every_kind_that_is_read_is_among_the_sources() -> None:
    endings = {name.rsplit(".", 1)[1] for name in SOURCES}
    missing = {kind.name for kind in TABLE if not any(ending[1:] in endings for ending in kind.endings)}
    assert missing <= set(ONLY_READ) - {"JPEG 2000", "SGI", "TGA", "ICO"}  # nothing but 8 bits, of which none is lost


# Of several frames, and of several pictures ------------------------------------------------------------------------


def plates(folder: Path) -> None:
    """Frames of which each loses more than the one before it."""
    pixels = with_alpha(light(np.float16))
    pixels[..., 3] = 1
    for number in range(1001, 1005):
        if number == 1002:
            pixels[0, 0] = -1
        if number == 1003:
            pixels[0, 1], pixels[0, 2, 3] = 5, 0.5
        if number == 1004:
            pixels[0, 3] = np.nan
        exr(folder / f"plate.{number}.exr", pixels, {})


@pytest.mark.parametrize("words", [["render", "still.toml"], ["apply", "m.npy"]])
def test_what_any_frame_loses_is_told_once(tmp_path: Path, fluidwarp: Run, words: list[str]) -> None:
    plates(tmp_path)
    (tmp_path / "still.toml").write_text(RECIPE)
    write_map(tmp_path / "m.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    depth = "holds 8 bits a channel and not the picture's 16-bit floats; it "
    ends, nowhere, alpha = "cuts values below 0 and above 1", "makes NaN black", "has no alpha, and is laid over black"

    def told(*more: str) -> str:
        ran = fluidwarp(tmp_path, *words, "plate.%d.exr", *more)
        assert ran.returncode == 0, ran.stderr
        return ran.stderr

    write = "write .exr to keep all of it\n"
    assert told("-o", "a.%d.jpg") == f"fluidwarp: a.%d.jpg {depth}{ends}; it {nowhere}; it {alpha}; {write}"
    assert told("-o", "b.%d.png") == f"fluidwarp: b.%d.png {ends}; it {nowhere}; {write}"
    assert told("-o", "c.%d.png", "--frames", "1001-1002") == (
        "fluidwarp: c.%d.png cuts values below 0; write .exr to keep it\n"
    )
    assert told("-o", "d.%d.exr") == ""
    assert told("-o", "e.mkv") == f"fluidwarp: e.mkv {ends}; it {nowhere}\n"


def test_what_a_clip_has_is_kept_or_told(tmp_path: Path, fluidwarp: Run) -> None:
    (tmp_path / "still.toml").write_text(RECIPE)

    def clip(name: str, how: str, *options: str) -> None:
        made = ["-f", "lavfi", "-i", f"testsrc=s={WIDTH}x{HEIGHT}:r=10:d=0.2,{how}", *options]
        subprocess.run([ffmpeg.executable(), "-v", "error", "-y", *made, str(tmp_path / name)], check=True)

    def told(name: str, output: str) -> str:
        ran = fluidwarp(tmp_path, "render", "still.toml", name, "-o", output)
        assert ran.returncode == 0, ran.stderr
        return ran.stderr.removeprefix("fluidwarp: ").rstrip()

    clip("deep.mkv", "format=yuv420p10le", "-c:v", "ffv1")
    assert told("deep.mkv", "a.%d.jpg") == (
        "a.%d.jpg holds 8 bits a channel and not the picture's 10; write .png to keep it"
    )
    assert told("deep.mkv", "a.gif") == "deep.mkv: its 10 bits a channel become 8"
    assert told("deep.mkv", "a.%d.png") == told("deep.mkv", "a.mov") == told("deep.mkv", "a.%d.exr") == ""
    clip("clear.webm", "format=rgba,colorchannelmixer=aa=0.5,format=yuva420p", "-c:v", "libvpx-vp9")
    assert told("clear.webm", "b.mp4") == "b.mp4 has no alpha, and is laid over black; write .mkv to keep it"
    assert told("clear.webm", "b.gif") == (
        "b.gif makes half-transparent pixels either whole or empty; write .mkv to keep it"
    )
    assert told("clear.webm", "b.mov") == told("clear.webm", "b.%d.png") == ""


@pytest.mark.parametrize("words", [["render", "still.toml"], ["apply", "m.npy"]], ids=lambda words: words[0])
def test_what_is_lost_depends_on_the_codec_and_the_depth_that_are_asked_for(
    tmp_path: Path, fluidwarp: Run, words: list[str]
) -> None:
    (tmp_path / "still.toml").write_text(RECIPE)
    write_map(tmp_path / "m.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    for number in (1, 2):
        write_picture(tmp_path / f"p.{number}.png", Picture(with_alpha(smooth()).astype(np.uint16) * 256))
    black, eight = "no alpha, and is laid over black", "holds 8 bits a channel"
    cases: dict[str, list[str]] = {
        "-o a.mov": [], "-o b.mov --codec prores-422-hq": [black], "-o c.%d.png": [], "-o d.%d.png --bits 8": [eight],
        "-o e.%d.jpg": [black, eight],
    }  # fmt: skip
    for way, lost in cases.items():
        ran = fluidwarp(tmp_path, *words, "p.%d.png", *way.split())
        assert ran.returncode == 0, ran.stderr
        assert [said for said in (black, eight) if said in ran.stderr] == lost, (way, ran.stderr)


@pytest.mark.parametrize("words", [["render", "still.toml"], ["apply", "m.npy"]])
def test_what_belongs_to_an_animated_picture_is_kept_or_told(tmp_path: Path, fluidwarp: Run, words: list[str]) -> None:
    (tmp_path / "still.toml").write_text(RECIPE)
    write_map(tmp_path / "m.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    further = [Image.fromarray(np.roll(smooth(), shift, 1)) for shift in (1, 2)]
    options = {"exif": exif(), "icc_profile": ICC, "xmp": XMP, "lossless": True}
    Image.fromarray(smooth()).save(tmp_path / "a.webp", save_all=True, append_images=further, **options)
    for output in ("b.mp4", "b.gif", "b.%d.png", "b.%d.exr"):
        ran = fluidwarp(tmp_path, *words, "a.webp", "-o", output)
        assert ran.returncode == 0, ran.stderr
        for key, thing in (CAMERA | {"profile": PROFILE, "xmp": GONE_XMP}).items():
            assert thing.kept(seen(tmp_path / output)) != bool(re.search(thing.told, ran.stderr)), (key, ran.stderr)


@pytest.mark.parametrize("output", ["{name}.exr", "to_{name}_2.exr", "{name} warped.exr", "w{name}w.exr"])
def test_what_many_pictures_lose_alike_is_told_of_the_first(tmp_path: Path, fluidwarp: Run, output: str) -> None:
    """Also where their names are words of what is written, or of what is said."""
    (tmp_path / "still.toml").write_text(RECIPE)
    (tmp_path / "out").mkdir()
    names = ["p", "warped", "w", "to", "XMP", "2"]
    for name in names:
        Image.fromarray(smooth()).save(tmp_path / f"{name}.jpg", xmp=b"" if name == "p" else XMP)
    ran = fluidwarp(tmp_path, "render", "still.toml", *(f"{name}.jpg" for name in names), "-o", f"out/{output}")
    said, first = "lacks the picture's XMP; write .png to keep it", output.format(name="warped")
    assert ran.returncode == 0
    assert ran.stderr.splitlines() == [
        f"fluidwarp: {tmp_path}/warped.jpg: {first} {said}", f"fluidwarp: and of 4 more: {{name}}.exr {said}"
    ]  # fmt: skip


def test_what_many_clips_lose_alike_is_told_of_the_first_also_where_processes_share_them(
    tmp_path: Path, fluidwarp: Run
) -> None:
    (tmp_path / "still.toml").write_text(RECIPE)
    names = ["a.mkv", "its.mkv", "3.mkv"]
    for name in names:
        made = ["-f", "lavfi", "-i", f"testsrc=s={WIDTH}x{HEIGHT}:r=10:d=0.3,setsar=3/2", "-c:v", "ffv1"]
        subprocess.run([ffmpeg.executable(), "-v", "error", "-y", *made, str(tmp_path / name)], check=True)
    ran = fluidwarp(tmp_path, "render", "still.toml", *names, "-o", "{name}.png", "--jobs", "2")
    first, rest = ran.stderr.splitlines()
    said = "its pixels of 3:2 become square; of its frames only the first is used"
    assert first in [f"fluidwarp: {tmp_path / name}: {said}" for name in names]
    assert rest == f"fluidwarp: and of 2 more: {{name}}.mkv: {said}"


def test_what_many_sequences_lose_alike_is_told_of_the_first(tmp_path: Path, fluidwarp: Run) -> None:
    """What a file of them has lost, and what is left out of them, under one name."""
    (tmp_path / "still.toml").write_text(RECIPE)
    inks = Image.fromarray(smooth()).convert("CMYK")

    def told(*words: str) -> list[str]:
        ran = fluidwarp(tmp_path, "render", "still.toml", *words)
        assert ran.returncode == 0, ran.stderr
        return [line.removeprefix("fluidwarp: ").replace(f"{tmp_path}/", "") for line in ran.stderr.splitlines()]

    for name in "ab":
        for number in (0, 1):
            inks.save(tmp_path / f"{name}.{number:04d}.jpg")
    became = "its inks (CMYK) become RGB"
    both = ["a.%04d.jpg", "b.%04d.jpg"]
    assert told(*both, "-o", "out")[:2] == [
        f"a.%04d.jpg: a.0000.jpg: {became}",
        f"and of 1 more: {{name}}.jpg: {became}",
    ]
    for name in "ab":
        inks.save(tmp_path / f"{name}.-001.jpg")
    said = f"{became}; a file with a number below 0 is not used"
    assert told(*both, "-o", "out") == [f"a.%04d.jpg: {said}", f"and of 1 more: {{name}}.jpg: {said}"]
    assert told("a.%04d.jpg", "-o", "x.png") == [f"a.%04d.jpg: {said}; of its 2 frames only the first is used"]
    inks.save(tmp_path / "a.-002.jpg")
    assert told("a.%04d.jpg", "-o", "o.%d.jpg") == [f"a.%04d.jpg: {became}; 2 files with numbers below 0 are not used"]


def test_what_is_said_of_many_pictures_in_the_same_words_is_told_once_whatever_their_names(
    tmp_path: Path, fluidwarp: Run
) -> None:
    """A number in what is said is the whole name of one of the pictures."""
    push = '[[stroke]]\ntool = "push"\nradius = 0.3\nsamples = [[0, 0.3, 0.5, 1.0]]\n'
    (tmp_path / "fine.toml").write_text(f"version = 5\nduration = 0.1\n[fluid]\ngrid = 388\ndt = 0.1\n{push}")
    names = ["p.png", "3.png", "8.png", "2.png"]
    for name in names:
        Image.fromarray(smooth()[:16, :16]).save(tmp_path / name)
    ran = fluidwarp(tmp_path, "render", "fine.toml", *names, "-o", "out")
    finer = "24.2 times as fine as the picture of 16 x 16 pixels"
    said = f"a grid of 388 cells is {finer}, and takes long; one of 16 is as fine"
    assert ran.returncode == 0
    assert ran.stderr == f"fluidwarp: {tmp_path}/p.png: {said}\nfluidwarp: and of 3 more: {said}\n"


# Where it ends ------------------------------------------------------------------------------------------------------


def test_what_rounds_to_white_or_black_is_not_cut() -> None:
    for bits, ending in ((8, ".jpg"), (16, ".png")):
        step = 1 / (2**bits - 1)
        for value, said in (
            (1 + step * 2.2, True),  # a code of sRGB is 2.27 times less light at white
            (1 + step * 1.1, False),
            (-step / 12, True),
            (-step / 26, False),
        ):
            picture = Picture(np.full((4, 4, 3), value, np.float32))
            assert ("cuts values" in unheld(f"a{ending}", picture)) == said, (bits, value)
    thin = np.full((4, 4, 4), 0.001, np.float32)  # divided by alpha it is as good as 1
    thin[..., 3] *= 1 - 2**-20
    assert "cuts" not in unheld("a.png", Picture(thin, premultiplied=True))


def test_a_half_is_cut_where_it_would_be_infinite() -> None:
    for value, said in ((65519.0, False), (65520.0, True), (-65520.0, True), (np.inf, False), (np.nan, False)):
        picture = Picture(np.full((4, 4, 3), value, np.float32))
        assert ("cuts values beyond 65504" in unheld("a.exr", picture, bits=16)) == said
        assert not unheld("a.exr", picture)


@pytest.mark.parametrize("bits", [8, 10, 12])
def test_values_of_16_bits_are_told_by_as_many_as_they_have(bits: int) -> None:
    codes = RNG(bits).integers(0, 2**bits, (16, 16, 3)).astype(np.uint32)
    picture = Picture((codes * 65535 // (2**bits - 1)).astype(np.uint16))
    assert ("not the picture's" in unheld("a.jpg", picture)) == (bits > 8)
    assert bits == 8 or f"and not the picture's {bits};" in unheld("a.jpg", picture)
    assert ("not the picture's" in unheld("a.exr", picture, bits=16)) == (bits > 11)
    assert not unheld("a.png", picture)


def test_pq_is_refused_where_nothing_tells_it(tmp_path: Path, fluidwarp: Run) -> None:
    """Stills as clips; a profile tells it too."""
    (tmp_path / "still.toml").write_text(RECIPE)
    write_map(tmp_path / "m.npy", Displacement(np.zeros((HEIGHT, WIDTH, 2), np.float32)))
    cv2.imwrite(str(tmp_path / "hdr.png"), deep(3))
    chunked(tmp_path / "hdr.png", cICP=PQ)
    for words in (["render", "still.toml"], ["apply", "m.npy"]):
        ran = fluidwarp(tmp_path, *words, "hdr.png", "-o", "a.jpg")
        assert ran.returncode != 0
        assert "Cannot write a.jpg: it cannot tell that the picture's colours are BT.2020 PQ; write .png" in ran.stderr
        assert not (tmp_path / "a.jpg").exists()
    ran = fluidwarp(tmp_path, "render", "still.toml", "hdr.png", "-o", "a.mp4")
    assert "Cannot write a.mp4: the picture's colours are BT.2020 PQ, and 8 bits are too few" in ran.stderr
    assert fluidwarp(tmp_path, "render", "still.toml", "hdr.png", "-o", "a.mov").returncode == 0
    assert seen(tmp_path / "a.mov").things == {"chunk cICP": PQ}
    Image.fromarray(smooth()).save(tmp_path / "both.png", icc_profile=ICC)
    chunked(tmp_path / "both.png", cICP=PQ)
    ran = fluidwarp(tmp_path, "render", "still.toml", "both.png", "-o", "b.jpg")
    assert ran.returncode == 0
    assert "b.jpg cannot tell the picture's BT.2020 PQ (cICP)" in ran.stderr


def test_a_large_tiff_has_its_exif(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As one of 4 GB is written."""
    Image.fromarray(smooth()).save(tmp_path / "a.jpg", exif=exif())
    picture = read_picture(tmp_path / "a.jpg")
    monkeypatch.setattr(tifffile, "imwrite", partial(tifffile.imwrite, bigtiff=True))
    write_picture(tmp_path / "a.tif", picture)
    assert (tmp_path / "a.tif").read_bytes()[2] == 43
    found = seen(tmp_path / "a.tif").things
    assert {key: found[key] for key in ("tag Artist", "tag DateTimeOriginal")} == {
        "tag Artist": "A. Painter",
        "tag DateTimeOriginal": "2020:01:02 03:04:05",
    }
    assert found["tag GPSInfo"]
    again = read_picture(tmp_path / "a.tif")
    assert not again.note
    write_picture(tmp_path / "b.jpg", again)
    assert seen(tmp_path / "b.jpg").things.keys() >= {"tag Artist", "tag DateTimeOriginal", "tag GPSInfo"}
