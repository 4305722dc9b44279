"""The table of formats: what it says a format keeps comes back, what it does not does not, and README says the same."""

from __future__ import annotations

import re
import struct
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageCms

from app.errors import UserError
from app.media.encoders import ANIMATIONS
from app.media.formats import FORMATS, TABLE, Format, check_picture_output
from app.media.holding import unheld
from app.media.pictures import read_picture, write_picture
from app.model.picture import Layer, Picture

WORDS = {
    "icc": {"profile"},
    "exif": {"EXIF"},
    "xmp": {"XMP"},
    "dpi": {"resolution"},
    "texts": {"texts", "comment"},
    "chunks": {"gAMA", "cHRM", "cICP"},
    "premultiplied": {"premultiplied alpha"},
    "chromaticities": {"primaries"},
    "attributes": {"attributes"},
    "layers": {"layers"},
    "group": {"layers"},
    "parts": {"parts"},
    "half": {"half floats"},
    "wide": {"overscan"},
    "margins": {"overscan"},
    "origin": {"windows"},
}
WRITTEN = [kind for kind in TABLE if kind.write]
DTYPES = {8: np.uint8, 16: np.uint16, 32: np.float32}


@pytest.mark.parametrize("kind", [kind for kind in WRITTEN if kind.longest < 2**31 - 1], ids=lambda kind: kind.name)
def test_neither_side_of_a_picture_is_longer_than_its_format_holds(kind: Format) -> None:
    path, most = f"a{kind.endings[0]}", kind.longest
    check_picture_output(path, size=(most, most))
    for size in (most + 1, 1), (1, most + 1):
        with pytest.raises(UserError, match=f"{size[0]} x {size[1]} pixels, and {kind.name} holds no side longer than"):
            check_picture_output(path, size=size)


def full(bits: int) -> Picture:
    """A picture that has everything that a picture can have."""
    exif = Image.Exif()
    exif[0x010F] = "A camera"
    return Picture(
        np.full((32, 40, 4), 0.5 if bits == 32 else 2 ** (bits - 1), DTYPES[bits]),
        icc=ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes(),
        exif=exif.tobytes(),
        xmp=b'<x:xmpmeta xmlns:x="adobe:ns:meta/"/>',
        dpi=(300.0, 150.0),
        chromaticities=(0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329),
        texts={"Comment": "seen by me"},
        premultiplied=True,
        attributes={"pixelAspectRatio": 0.5},
        chunks={b"gAMA": (100_000).to_bytes(4, "big")},
        layers=(Layer("Z", np.ones((35, 43), np.float32), exact=True, part=0),),
        parts=({"name": "depth"}, {"name": "beauty"}),
        group=(1, "beauty."),
        half=True,
        wide=np.full((35, 43, 4), 0.5 if bits == 32 else 2 ** (bits - 1), DTYPES[bits]),
        margins=(1, 1, 2, 2),
        origin=(5, -7),
    )


def came_back(name: str, given: Picture, read: Picture) -> bool:
    was, now = getattr(given, name), getattr(read, name)
    if name in ("exif", "xmp"):  # written anew
        return bool(now)
    if name == "wide":
        return now is not None and np.array_equal(now, was)
    if name == "layers":
        return [(layer.name, layer.exact, layer.part) for layer in now] == [("Z", True, 0)]
    if name == "chromaticities" or name == "dpi":
        return now is not None and now == pytest.approx(was, rel=1e-3)
    if name == "parts":
        return [part.get("name") for part in now] == ["depth", "beauty"]
    return was.items() <= now.items() if isinstance(was, dict) else now == was


@pytest.mark.parametrize("kind", WRITTEN, ids=lambda kind: kind.name)
def test_a_format_keeps_what_the_table_says_and_nothing_else(tmp_path: Path, kind: Format):
    path, given = tmp_path / f"a{kind.endings[0]}", full(kind.bits[-1])
    write_picture(path, given)
    read = read_picture(path)
    told = {field.name for field in fields(Picture)} - {"pixels", "note"}
    assert {name for name in told if came_back(name, given, read)} == kind.keeps
    assert read.has_alpha == kind.alpha
    for bits in kind.bits:
        write_picture(path, given, bits=bits)
        read = read_picture(path)
        assert (16 if read.half else read.bits) == bits
    grey = replace(given.with_pixels(given.pixels[..., :1]), icc=None)
    write_picture(path, grey)
    assert (read_picture(path).pixels.shape[2] == 1) == kind.grey


@pytest.mark.parametrize("kind", [kind for kind in WRITTEN if kind.name != "OpenEXR"], ids=lambda kind: kind.name)
def test_what_is_written_is_one_picture_and_its_metadata_to_another_program(tmp_path: Path, kind: Format):
    """With all that EXIF has, which Pillow finds in it again; the last directory of a TIFF names none after it."""
    exif = Image.Exif()
    exif[0x010F] = "A camera"
    exif.get_ifd(0x8769)[0x9003] = "2020:01:02 03:04:05"
    exif.get_ifd(0x8825)[1] = "N"
    path = tmp_path / f"a{kind.endings[0]}"
    for bits in {*kind.bits} - {32}:  # of which Pillow reads no colours
        write_picture(path, replace(full(8), exif=exif.tobytes()), bits=bits)
        with Image.open(path) as image:
            assert getattr(image, "n_frames", 1) == 1
            found = image.getexif()
            assert (found[0x010F], found.get_ifd(0x8769)[0x9003], found.get_ifd(0x8825)[1]) == (
                "A camera", "2020:01:02 03:04:05", "N"
            )  # fmt: skip
        if kind.name == "TIFF":
            data = path.read_bytes()
            (at,) = struct.unpack_from("<I", data, 4)
            (count,) = struct.unpack_from("<H", data, at)
            assert struct.unpack_from("<I", data, at + 2 + 12 * count) == (0,)
        assert read_picture(path).note == ""


def test_the_table_names_each_ending_and_each_signature_once():
    endings = [ending for kind in TABLE for ending in kind.endings]
    assert len(endings) == len(set(endings))
    assert list(FORMATS) == [ending for kind in WRITTEN for ending in kind.endings]
    assert all(kind.signature for kind in WRITTEN)


PILLOWS = {"JPEG 2000": "JPEG2000", "PGM": "PPM", "PBM": "PPM", "PNM": "PPM"}


@pytest.mark.parametrize("kind", [kind for kind in TABLE if not kind.write], ids=lambda kind: kind.name)
def test_a_picture_under_the_ending_of_another_kind_is_what_it_is(tmp_path: Path, kind: Format) -> None:
    """Of each kind that is only read, written by Pillow under the ending of every kind."""
    mode = {"PGM": "L", "PBM": "1"}.get(kind.name, "RGB")
    y, x = np.mgrid[0:32, 0:32]
    colours = np.stack([x * 7, y * 7, (x + y) % 8 * 30], axis=-1).astype(np.uint8)
    given = Image.fromarray(colours).convert("P").convert("RGB").convert(mode)
    file = tmp_path / "a"
    lossless = (
        {"irreversible": False} if kind.name == "JPEG 2000" else {"sizes": [(32, 32)]} if kind.name == "ICO" else {}
    )
    given.save(file, format=PILLOWS.get(kind.name, kind.name), **lossless)
    for other in TABLE:
        for ending in other.endings:
            file = file.rename(file.with_name(f"a{ending}"))
            if kind.signature is None and other.signature is not None:  # by its ending alone it is nothing else
                with pytest.raises(UserError, match="Cannot read"):
                    read_picture(file)
                continue
            read = read_picture(file).pixels[..., :3]
            np.testing.assert_array_equal(
                read, np.asarray(given.convert("L" if mode == "1" else mode)).reshape(read.shape)
            )


def rows(heading: str) -> dict[str, list[str]]:
    """The rows of a table of README's formats, by their first cell."""
    text = (Path(__file__).parents[2] / "README.md").read_text("utf-8").split("## Formats")[1]
    table = text.split(f"| {heading} |")[1].split("\n\n")[0]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]
    return {first: rest for first, *rest in cells}


def test_readme_tells_what_the_table_does():
    told = rows("picture")
    for kind in WRITTEN:
        _, out, keeps = told[kind.name]
        assert tuple(int(bits) for bits in re.findall(r"\b(8|16|32)\b", out)) == kind.bits, kind.name
        assert ("alpha laid over" in out) == (not kind.alpha)
        words = set(filter(None, keeps.split(", ")))
        assert {name for name, said in WORDS.items() if said & words} == kind.keeps, kind.name
        assert words <= set().union(*WORDS.values()), kind.name
    (only_read,) = [names for names, (_, out, _) in told.items() if not out]
    assert only_read == ", ".join(sorted(kind.name for kind in TABLE if not kind.write))
    assert set(told) == {kind.name for kind in WRITTEN} | {only_read, "`name.%04d.png`"}


def test_readme_names_every_kind_of_animation():
    told = ", ".join(rows("other")).upper()
    assert all(ending.removeprefix(".").upper() in told for ending in ANIMATIONS)


def test_a_colour_profile_that_a_file_cannot_hold_is_told() -> None:
    """But for sRGB's, as which what has none is read."""
    usual = full(8).icc
    assert usual is not None
    wide = Picture(
        np.zeros((4, 4, 3), np.uint8), icc=usual.replace("sRGB".encode("utf-16-be"), "Wide".encode("utf-16-be"))
    )
    said = "cannot hold the picture's colour profile (Wide built-in), and is read as sRGB"
    for name, animated in (("a.exr", False), ("a.mp4", True), ("a.webp", True), ("a.gif", True)):
        mend = "" if animated else "; write .png to keep it"
        assert unheld(name, wide, animated=animated) == f"{name} {said}{mend}"
        assert unheld(name, replace(wide, icc=usual), animated=animated) == ""
        damaged = replace(wide, icc=b"damaged")
        assert unheld(name, damaged, animated=animated) == f"{name} {said.replace('Wide built-in', 'damaged')}"
    for name in ("a.png", "a.tif"):
        told = "lacks the picture's colour profile (damaged), which is not for its colours"
        assert unheld(name, damaged) == f"{name} {told}"
    for name, animated in (("a.png", False), ("a.webp", False), ("a.%04d.png", True)):
        assert unheld(name, wide, animated=animated) == ""
