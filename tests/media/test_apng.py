"""Frames of an animated PNG, GIF or WebP, against the laws of alpha in float64 and against ffmpeg; and damaged ones."""

from __future__ import annotations

import io
import struct
import subprocess
import zlib
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.errors import UserError
from app.media import pages
from app.media.codecs import apng, layered, pillow
from app.media.codecs import gif as gif_codec
from app.media.codecs import webp as webp_codec
from app.media.ffmpeg import executable
from app.media.pages import read_pages
from app.media.pictures import read_picture
from app.media.source import open_source

WIDTH, HEIGHT = 16, 12
Part = tuple[int, int, np.ndarray, int, int]
"""x, y, the pixels, what becomes of it (0 stays, 1 cleared, 2 as before), whether it is laid over what is there."""


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def encoded(parts: Sequence[Part], default: bool = False, colour: int = 6, bits: int = 8, more: bytes = b"") -> bytes:
    """An animated PNG; `default` has a picture before it for readers that know none."""

    def rows(pixels: np.ndarray) -> bytes:
        kind = ">u2" if bits == 16 else "u1"
        return zlib.compress(b"".join(b"\0" + row.astype(kind).tobytes() for row in pixels))

    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", WIDTH, HEIGHT, bits, colour, 0, 0, 0))
    data += chunk(b"acTL", struct.pack(">II", len(parts), 3)) + more
    data += chunk(b"IDAT", rows(np.full((HEIGHT, WIDTH, 4), 77))) if default else b""
    for number, (x, y, pixels, disposal, over) in enumerate(parts):
        size = pixels.shape[1], pixels.shape[0], x, y, number + 1, 10, disposal, over
        data += chunk(b"fcTL", struct.pack(">IIIIIHHBB", 2 * number, *size))
        first = number == 0 and not default
        data += chunk(b"IDAT", rows(pixels)) if first else chunk(b"fdAT", struct.pack(">I", 1) + rows(pixels))
    return data + chunk(b"IEND", b"")


def composed(parts: Sequence[Part]) -> list[np.ndarray]:
    """What is seen of each part in turn, in float64."""
    canvas, seen = np.zeros((HEIGHT, WIDTH, 4)), []
    for number, (x, y, pixels, disposal, over) in enumerate(parts):
        place, before = (slice(y, y + len(pixels)), slice(x, x + pixels.shape[1])), canvas.copy()
        own, below = pixels.astype(float), canvas[place]
        if over:
            share, rest = own[..., 3:] / 255, below[..., 3:] / 255 * (1 - own[..., 3:] / 255)
            with np.errstate(invalid="ignore"):
                colours = np.nan_to_num((own[..., :3] * share + below[..., :3] * rest) / (share + rest))
            own = np.concatenate([colours, 255 * (share + rest)], axis=2)
        canvas[place] = own
        seen.append(canvas.copy())
        if disposal == 2 and number:
            canvas = before
        elif disposal:
            canvas[place] = 0
    return seen


def some(rng: np.random.Generator, height: int = HEIGHT, width: int = WIDTH) -> np.ndarray:
    pixels = rng.integers(0, 256, (height, width, 4))
    pixels[..., 3] = rng.choice([0, 255, 90, 200], (height, width))
    return pixels


@pytest.mark.parametrize("default", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_frames_are_laid_over_one_another_as_alpha_says(tmp_path: Path, seed: int, default: bool):
    rng = np.random.default_rng(seed)
    parts: list[Part] = [(0, 0, some(rng), int(rng.integers(3)), 0)]
    for _ in range(6):
        width, height = rng.integers(1, (WIDTH, HEIGHT))
        x, y = rng.integers(0, (WIDTH - width + 1, HEIGHT - height + 1))
        parts.append((int(x), int(y), some(rng, height, width), int(rng.integers(3)), int(rng.integers(2))))
    (path := tmp_path / "a.png").write_bytes(encoded(parts, default))
    clip = read_pages(path, read_picture(path))
    assert clip is not None
    assert (clip.loops, clip.durations, clip.alpha) == (3, (1, 2, 3, 4, 5, 6, 7), True)
    command = [executable(), "-v", "error", "-f", "apng", "-i", path, "-fps_mode", "passthrough"]
    done = subprocess.run([*command, "-f", "rawvideo", "-pix_fmt", "rgba", "-"], capture_output=True, check=True)
    theirs = np.frombuffer(done.stdout, np.uint8).reshape(-1, HEIGHT, WIDTH, 4)
    for (_, read), wanted, other in zip(clip.pictures(), composed(parts), theirs, strict=True):
        seen = wanted[..., 3] > 0
        assert np.abs(read.pixels - wanted)[seen].max(initial=0) < 1  # of half a code is each rounded to
        assert not read.pixels[~seen, 3].any()
        assert np.abs(other[..., 3] - wanted[..., 3]).max() <= 3


@pytest.mark.parametrize(
    ("shown", "rate", "steps"),
    [((33, 40), 1000, (33, 40)), ((20, 30), 100, (2, 3)), ((40, 40), 25, None), ((1, 2), 1000, (1, 2))],
)
def test_the_steps_of_frames_are_the_longest_that_fit(
    tmp_path: Path, shown: tuple[int, int], rate: int, steps: tuple[int, int] | None
):
    """By milliseconds, up to 1000 a second."""
    frames = [Image.new("RGBA", (WIDTH, HEIGHT), (number, 0, 0, 255)) for number in range(2)]
    frames[0].save(path := tmp_path / "a.webp", save_all=True, append_images=frames[1:], duration=shown, lossless=True)
    clip = read_pages(path, read_picture(path))
    assert clip is not None
    assert (clip.fps, clip.durations) == (rate, steps)


def test_what_covers_all_or_nothing_changes_no_bit(tmp_path: Path):
    rng = np.random.default_rng(0)
    under, over = some(rng), some(rng)
    under[..., 3], over[..., 3] = rng.integers(0, 256, (HEIGHT, WIDTH)), 255 * rng.integers(0, 2, (HEIGHT, WIDTH))
    (path := tmp_path / "a.png").write_bytes(encoded([(0, 0, under, 0, 0), (0, 0, over, 0, 1)]))
    clip = read_pages(path, read_picture(path))
    assert clip is not None
    _, (_, read) = clip.pictures()
    np.testing.assert_array_equal(read.pixels, np.where(over[..., 3:] == 255, over, under))


def test_what_is_cleared_is_transparent_though_no_frame_is(tmp_path: Path):
    parts = [(0, 0, np.full((HEIGHT, WIDTH, 3), 9), 0, 0), (2, 2, np.full((4, 4, 3), 50), 1, 0)]
    parts.append((0, 0, np.full((1, 1, 3), 99), 0, 0))
    (path := tmp_path / "a.png").write_bytes(encoded(parts, colour=2))
    clip = read_pages(path, read_picture(path))
    assert clip is not None
    assert [(read.pixels[..., 3] == 0).sum() for _, read in clip.pictures()] == [0, 0, 16]


def test_an_animation_has_alpha_only_where_something_is_seen_through(tmp_path: Path):
    whole, part = np.full((HEIGHT, WIDTH, 4), 255), np.full((4, 4, 4), 255)
    clear = part - [0, 0, 0, 255]
    pierced = np.full((6, 8, 4), 255)
    pierced[1:5, 2:6, 3] = 0
    patch = pierced.copy()
    patch[..., 3] = 255 - pierced[..., 3]
    for parts, seen in {
        "whole": ([(0, 0, whole, 1, 0), (0, 0, whole, 0, 0)], False),
        "left bare": ([(0, 0, whole, 1, 0), (0, 0, part, 0, 0)], True),
        "bare at the end": ([(0, 0, whole, 0, 0), (0, 0, part, 1, 0)], False),
        "covered again": ([(0, 0, whole, 0, 0), (2, 2, part, 1, 0), (2, 2, part, 0, 0)], False),
        "one aside": ([(0, 0, whole, 0, 0), (2, 2, part, 1, 0), (3, 2, part, 0, 0)], True),
        "one above": ([(0, 0, whole, 0, 0), (2, 2, part, 1, 0), (2, 1, part, 0, 0)], True),
        "as before": ([(0, 0, whole, 0, 0), (2, 2, part, 2, 0), (3, 2, part, 0, 0)], False),
        "nothing before": ([(0, 0, whole, 2, 0), (3, 2, part, 0, 0)], True),
        "see-through": ([(0, 0, whole, 0, 0), (2, 2, clear, 0, 0)], True),
        "laid over": ([(0, 0, whole, 0, 0), (2, 2, clear, 0, 1)], False),
        "laid over what is cleared": ([(0, 0, whole, 0, 0), (2, 2, part, 1, 0), (2, 2, clear, 0, 1)], True),
        "patched": ([(0, 0, whole, 0, 0), (4, 3, part, 1, 0), (2, 2, patch, 0, 1)], False),
        "patched all around": ([(0, 0, whole, 0, 0), (4, 3, part, 1, 0), (2, 2, pierced, 0, 1)], True),
        "cleared again": ([(0, 0, whole, 0, 0), (2, 2, part, 1, 0), (2, 2, part, 2, 0), (9, 2, part, 0, 0)], True),
    }.values():
        found = apng.read(encoded(parts))
        assert found is not None
        assert found.has_alpha(400_000_000) == seen
        assert any(canvas[..., 3].min() < 255 for canvas in found.shown()) == seen


def test_opening_decodes_nothing_where_that_is_too_much_to_look_at():
    whole = np.full((HEIGHT, WIDTH, 4), 255)
    data = encoded([(0, 0, whole, 0, 0)] * 3)
    at = data.index(b"IDAT")
    length = int.from_bytes(data[at - 4 : at], "big")
    found = apng.read(data[: at - 4] + chunk(b"IDAT", b"no deflate") + data[at + 8 + length :])
    assert found is not None
    assert found.has_alpha(3 * HEIGHT * WIDTH - 1)
    with pytest.raises(Exception, match="IDAT"):
        found.has_alpha(3 * HEIGHT * WIDTH)


def test_opening_decodes_no_frame_that_lies_over_what_is_opaque_and_no_more_than_a_picture(tmp_path: Path):
    whole = np.full((HEIGHT, WIDTH, 4), 255)
    for blend, most, seen in ((1, HEIGHT * WIDTH, False), (0, HEIGHT * WIDTH, True), (0, 3 * HEIGHT * WIDTH, False)):
        found = apng.read(encoded([(0, 0, whole, 0, 0), (0, 0, whole, 0, blend), (0, 0, whole, 0, blend)]))
        assert found is not None
        assert found.has_alpha(most) == seen


@pytest.mark.parametrize("colour", [0, 2, 4, 6])
def test_frames_of_16_bits_are_read_in_8(tmp_path: Path, colour: int):
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[colour]
    pixels = np.random.default_rng(colour).integers(0, 65536, (2, HEIGHT, WIDTH, channels))
    data = encoded([(0, 0, pixels[0], 0, 0), (0, 0, pixels[1], 0, 0)], colour=colour, bits=16)
    (path := tmp_path / "a.png").write_bytes(data)
    found = apng.read(path.read_bytes())
    assert found is not None
    for canvas, wanted in zip(found.shown(), pixels >> 8, strict=True):
        colours = wanted[..., :1].repeat(3, axis=2) if channels < 3 else wanted[..., :3]
        np.testing.assert_array_equal(canvas[..., :3], colours)
        np.testing.assert_array_equal(canvas[..., 3], wanted[..., -1] if channels in (2, 4) else 255)


def test_times_and_transparent_colours_of_frames(tmp_path: Path):
    grey = np.random.default_rng(0).integers(0, 2, (HEIGHT, WIDTH, 1))
    key = chunk(b"tRNS", struct.pack(">H", 1))
    data = encoded([(0, 0, grey, 0, 0), (0, 0, 1 - grey, 0, 0)], colour=0, more=key)
    (path := tmp_path / "a.png").write_bytes(data)
    found = apng.read(path.read_bytes())
    assert found is not None
    assert [frame.seconds for frame in found.frames] == [Fraction(1, 10), Fraction(2, 10)]
    first, second = (canvas.copy() for canvas in found.shown())
    np.testing.assert_array_equal(first[..., 3], np.where(grey[..., 0] == 1, 0, 255))
    np.testing.assert_array_equal(second[..., 3], np.where(grey[..., 0] == 0, 0, 255))
    control = data.index(b"fcTL") + 4
    short = data[:control] + data[control : control + 22] + b"\0\0" + data[control + 24 :]
    path.write_bytes(
        short[: control + 26] + struct.pack(">I", zlib.crc32(short[control - 4 : control + 26])) + short[control + 30 :]
    )
    again = apng.read(path.read_bytes())
    assert again is not None
    assert again.frames[0].seconds == Fraction(1, 100)


@pytest.mark.parametrize(
    ("fault", "told"),
    [("cut", "chunk fdAT is damaged"), ("few", "has 1 of its 2 frames"), ("beyond", "reaches beyond the picture"),
     ("flipped", "chunk fdAT is damaged")],
)  # fmt: skip
def test_a_damaged_animation_is_told_as_that(tmp_path: Path, fault: str, told: str):
    pixels = some(np.random.default_rng(0))
    data = encoded([(0, 0, pixels, 0, 0), (0, 0, pixels[:4, :4], 0, 1)])
    match fault:
        case "cut":
            data = data[:-40]
        case "few":
            at = data.rindex(b"fcTL") - 4
            data = data[:at] + chunk(b"IEND", b"")
        case "beyond":
            data = encoded([(0, 0, pixels, 0, 0), (WIDTH - 3, 0, pixels[:4, :4], 0, 1)])
        case _:
            at = data.rindex(b"fdAT") + 20
            data = data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]
    (path := tmp_path / "a.png").write_bytes(data)
    with pytest.raises(UserError, match=rf"a\.png: the PNG file is truncated or damaged \(.*{told}\); get it again\.$"):
        read_pages(path, read_picture(path))


def gif(parts: Sequence[tuple[int, int, np.ndarray, int, int | None]], colours: np.ndarray) -> bytes:
    """A GIF of eight colours: x, y, the numbers of colours, what becomes of it, and the number that is none."""
    data = b"GIF89a" + struct.pack("<HHBBB", WIDTH, HEIGHT, 0xF2, 0, 0) + colours.astype(np.uint8).tobytes()
    for x, y, numbers, disposal, key in parts:
        data += struct.pack("<BBBBHBB", 0x21, 0xF9, 4, disposal << 2 | (key is not None), 10, key or 0, 0)
        data += struct.pack("<BHHHHB", 0x2C, x, y, numbers.shape[1], numbers.shape[0], 0)
        # Of 4 bits each: a code that clears before what would need 5, the numbers, and the end.
        codes = [code for at, one in enumerate(numbers.ravel()) for code in ([8] * (at % 6 == 0) + [int(one)])] + [9]
        nibbles = [*codes, 0][: len(codes) + len(codes) % 2]
        packed = bytes(low | high << 4 for low, high in zip(nibbles[::2], nibbles[1::2], strict=True))
        blocks = [packed[at : at + 255] for at in range(0, len(packed), 255)]
        data += b"\3" + b"".join(bytes([len(block)]) + block for block in blocks) + b"\0"
    return data + b";"


@pytest.mark.parametrize("key", [None, 5])
def test_what_a_gif_clears_is_transparent_though_its_first_frame_is_opaque(tmp_path: Path, key: int | None):
    rng = np.random.default_rng(0)
    colours, numbers = rng.integers(0, 256, (8, 3)), rng.integers(0, 8, (4, HEIGHT, WIDTH))
    parts = [
        (0, 0, numbers[0], 1, key),
        (2, 1, numbers[1][:6, :7], 2, 3),
        (8, 4, numbers[2][:5, :5], 3, 1),
        (1, 1, numbers[3][:3, :3], 0, 2),
    ]
    (path := tmp_path / "a.gif").write_bytes(gif(parts, colours))
    clip = read_pages(path, read_picture(path))
    assert clip is not None
    over = [
        (
            x,
            y,
            np.dstack([colours[part], np.where(part == none, 0, 255)[..., None]]),
            {1: 0, 0: 0, 2: 1, 3: 2}[disposal],
            1,
        )
        for x, y, part, disposal, none in parts
    ]
    for (_, read), wanted in zip(clip.pictures(), composed(over), strict=True):
        seen = wanted[..., 3] > 0
        np.testing.assert_array_equal(read.pixels[..., 3] > 0, seen)
        np.testing.assert_array_equal(read.pixels[seen], wanted[seen])
    (_, later), *_ = clip.pictures((2, None))
    np.testing.assert_array_equal(later.pixels[..., 3], composed(over)[2][..., 3])


@pytest.mark.parametrize("seed", range(12))
def test_frames_of_a_gif_are_laid_over_one_another_as_browsers_do_it(tmp_path: Path, seed: int):
    """By the law in float64: frames that cover a part, beside or beyond the picture, with a key or none."""
    rng = np.random.default_rng(seed)
    colours = rng.integers(0, 256, (8, 3))
    parts, wanted = [], list[Part]()
    for number in range(6):
        x, y = (int(rng.integers(0, most)) for most in (WIDTH + 3, HEIGHT + 3))
        width, height = (int(rng.integers(1, most)) for most in (WIDTH, HEIGHT))
        if number == 0:
            x, y, width, height = (0, 0, WIDTH, HEIGHT) if seed % 2 else (2, 1, WIDTH - 3, HEIGHT - 2)
        numbers = rng.integers(0, 8, (height, width))
        disposal, key = int(rng.integers(4)), 3 if rng.integers(2) else None
        parts.append((x, y, numbers, disposal, key))
        alpha = np.where(numbers == key, 0, 255)[..., None]
        seen = np.dstack([colours[numbers], alpha])[: max(HEIGHT - y, 0), : max(WIDTH - x, 0)]
        wanted.append((x, y, seen, {2: 1, 3: 2}.get(disposal, 0), 1))
    (path := tmp_path / "a.gif").write_bytes(gif(parts, colours))
    clip = read_pages(path, first := read_picture(path))
    assert clip is not None
    canvases = composed(wanted)
    assert clip.alpha == any(canvas[..., 3].min() < 255 for canvas in canvases)
    for read, canvas in zip(
        [first, *(picture for _, picture in clip.pictures())], [canvases[0], *canvases], strict=True
    ):
        seen = canvas[..., 3] > 0
        np.testing.assert_array_equal(read.pixels[..., 3] > 0 if read.has_alpha else np.ones_like(seen), seen)
        np.testing.assert_array_equal(read.pixels[..., :3][seen], canvas[..., :3][seen])


def test_what_is_no_block_of_a_gif_is_passed_over(tmp_path: Path):
    numbers = [(0, 0, np.full((HEIGHT, WIDTH), number), 0, None) for number in (1, 2)]
    colours = np.arange(24).reshape(8, 3)
    one, both = gif(numbers[:1], colours)[:-1], gif(numbers, colours)[:-1]
    second, none = both[len(one) :], bytes(range(32)) * 40  # no sign of a block is in it
    for end in (b"", b";"):
        (path := tmp_path / "a.gif").write_bytes(one + none + second + none + end)
        first = read_picture(path)
        clip = read_pages(path, first)
        assert clip is not None
        assert first.note == "a.gif: of its 2 frames only the first is used"
        assert [picture.pixels[0, 0].tolist() for _, picture in clip.pictures()] == [[3, 4, 5], [6, 7, 8]]


def test_of_a_gif_no_more_blocks_are_looked_at_than_a_bound(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    data = gif([(0, 0, np.zeros((HEIGHT, WIDTH), int), 0, None)] * 2, np.zeros((8, 3)))
    (path := tmp_path / "a.gif").write_bytes(data[:-1] + b"!\xfe\0" * 5 + data[-1:])
    monkeypatch.setattr(gif_codec, "MOST_EXTENSIONS", 7)
    assert read_pages(path, read_picture(path)) is not None
    monkeypatch.setattr(gif_codec, "MOST_EXTENSIONS", 6)
    with pytest.raises(UserError, match=r"it has more than 6 blocks that are no picture\); get it again\.$"):
        read_picture(path)


def riff(kind: bytes, body: bytes) -> bytes:
    return kind + struct.pack("<I", len(body)) + body + b"\0" * (len(body) % 2)


def webp(parts: Sequence[Part], told: bool, lossless: bool = True) -> bytes:
    """An animated WebP that plays three times; `told`: its head says that it has alpha."""

    def three(*numbers: int) -> bytes:
        return b"".join(struct.pack("<I", number)[:3] for number in numbers)

    body = riff(b"VP8X", struct.pack("<I", 0x12 if told else 2) + three(WIDTH - 1, HEIGHT - 1))
    body += riff(b"ANIM", struct.pack("<IH", 0xFF0000FF, 3))
    for number, (x, y, pixels, disposal, over) in enumerate(parts):
        Image.fromarray(pixels.astype(np.uint8)).save(
            file := io.BytesIO(), "WEBP", lossless=lossless, exact=True, quality=90
        )
        data, at, picture = file.getvalue(), 12, b""
        while at + 8 <= len(data):
            kind, length = struct.unpack_from("<4sI", data, at)
            picture += data[at : at + 8 + length + length % 2] if kind in (b"ALPH", b"VP8 ", b"VP8L") else b""
            at += 8 + length + length % 2
        place = three(x // 2, y // 2, pixels.shape[1] - 1, pixels.shape[0] - 1, 100 * (number + 1))
        body += riff(b"ANMF", place + bytes([disposal | (0 if over else 2)]) + picture)
    return riff(b"RIFF", b"WEBP" + body)


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_frames_of_a_webp_are_laid_over_one_another_as_browsers_do_it(tmp_path: Path, seed: int, told: bool):
    """By the law in float64: what no frame covers, or one clears, is transparent, whatever the file's head says."""
    rng = np.random.default_rng(seed)
    parts = list[Part]()
    for number in range(6):
        width, height = (int(rng.integers(1, most)) for most in (WIDTH, HEIGHT))
        x, y = (int(rng.integers(0, (most - side) // 2 + 1)) * 2 for most, side in ((WIDTH, width), (HEIGHT, height)))
        if number == 0 and seed % 2:
            x, y, width, height = 0, 0, WIDTH, HEIGHT
        pixels = some(rng, height, width)
        pixels = pixels if rng.integers(2) else np.dstack([pixels[..., :3], np.full((height, width), 255)])
        parts.append((x, y, pixels, int(rng.integers(2)), int(rng.integers(2))))
    (path := tmp_path / "a.webp").write_bytes(webp(parts, told))
    clip = read_pages(path, first := read_picture(path))
    assert clip is not None
    assert (clip.loops, clip.durations, clip.fps) == (3, (1, 2, 3, 4, 5, 6), 10)
    canvases = composed(parts)
    assert clip.alpha
    for read, wanted in zip((picture for _, picture in clip.pictures()), canvases, strict=True):
        seen = wanted[..., 3] > 0
        assert np.abs(read.pixels - wanted)[seen].max(initial=0) < 1
        assert not read.pixels[~seen, 3].any()
    if first.has_alpha:
        np.testing.assert_array_equal(first.pixels[..., 3] > 0, canvases[0][..., 3] > 0)
    else:
        assert (canvases[0][..., 3] == 255).all()


@pytest.mark.parametrize("lossless", [True, False])
@pytest.mark.parametrize("whole", [True, False])
def test_what_no_frame_of_a_webp_covers_is_transparent_though_none_has_alpha(
    tmp_path: Path, lossless: bool, whole: bool
):
    size = (HEIGHT, WIDTH) if whole else (4, 4)
    parts: list[Part] = [(0, 0, np.full((*size, 3), 200), 0, 1), (6, 4, np.full((4, 4, 3), 90), 0, 1)]
    (path := tmp_path / "a.webp").write_bytes(webp(parts, told=False, lossless=lossless))
    first = read_picture(path)
    clip = read_pages(path, first)
    assert clip is not None
    assert (clip.alpha, first.has_alpha) == (not whole, not whole)
    if not whole:
        pictures = [picture for _, picture in clip.pictures()]
        assert [int((picture.pixels[..., 3] == 255).sum()) for picture in (first, *pictures)] == [16, 16, 32]
        assert {int(one) for picture in pictures for one in np.unique(picture.pixels[..., 3])} == {0, 255}


def test_frames_of_a_webp_with_losses_keep_their_alpha(tmp_path: Path):
    pixels = np.full((HEIGHT, WIDTH, 4), [200, 90, 40, 255])
    pixels[:, :5, 3] = 0
    (path := tmp_path / "a.webp").write_bytes(webp([(0, 0, pixels, 0, 0)] * 2, told=True, lossless=False))
    clip = read_pages(path, read_picture(path))
    assert clip is not None
    for _, picture in clip.pictures():
        np.testing.assert_array_equal(picture.pixels[..., 3], pixels[..., 3])
        assert np.abs(picture.pixels[:, 6:, :3] - pixels[:, 6:, :3].astype(int)).max() < 12


@pytest.mark.parametrize(
    ("fault", "told"),
    [("beyond", "reaches beyond the picture"), ("other size", "is not as large as it says"),
     ("cut", "is not as large as it says"), ("short", "is cut"), ("empty", "is not as large as it says")],
)  # fmt: skip
def test_a_damaged_animated_webp_is_told_as_that(tmp_path: Path, fault: str, told: str):
    part = np.full((4, 4, 3), 90)
    data = webp([(0, 0, part, 0, 1), (WIDTH - 2 if fault == "beyond" else 6, 4, part, 0, 1)], told=False)
    last = data.rindex(b"ANMF")
    if fault == "other size":
        data = data[: last + 14] + b"\1" + data[last + 15 :]
    elif fault == "cut":
        data = data[: last + 30]
    elif fault in ("empty", "short"):
        length = 16 if fault == "empty" else 15
        data = data[: last + 4] + struct.pack("<I", length) + data[last + 8 : last + 8 + length] + b"\0" * (length % 2)
        data = data[:4] + struct.pack("<I", len(data) - 8) + data[8:]
    (path := tmp_path / "a.webp").write_bytes(data)
    with pytest.raises(ValueError, match=f"^a frame of it {told}$"):
        webp_codec.frames(data)
    with pytest.raises(UserError, match=r"a\.webp: the WebP file is truncated or damaged .*; get it again\.$"):
        read_pages(path, read_picture(path))


@pytest.mark.parametrize("kind", ["png", "gif", "webp"])
def test_of_an_animation_no_more_frames_are_read_than_a_bound(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
):
    for module in (layered, apng, gif_codec, pages, pillow):
        monkeypatch.setattr(module, "MOST_FRAMES", 3)
    parts: list[Part] = [(0, 0, np.full((HEIGHT, WIDTH, 4), 90 + number), 0, 1) for number in range(4)]
    numbers = [(0, 0, np.zeros((HEIGHT, WIDTH), int), 0, None)] * 4
    for count in (3, 4):
        match kind:
            case "png":
                data = encoded(parts[:count])
            case "gif":
                data = gif(numbers[:count], np.zeros((8, 3)))
            case _:
                data = webp(parts[:count], told=True)
        (path := tmp_path / f"a.{kind}").write_bytes(data)
        first = read_picture(path)
        if count == 3:
            clip = read_pages(path, first)
            assert clip is not None
            assert (clip.frames, first.note) == (3, f"a.{kind}: of its 3 frames only the first is used")
        else:
            assert first.note == f"a.{kind}: of its more than 3 frames only the first is used"
            with pytest.raises(UserError, match=r"^Cannot read .*: it has more than 3 frames; cut it into parts\.$"):
                read_pages(path, first)


@pytest.mark.parametrize("kind", ["png", "gif", "webp"])
def test_a_frame_larger_than_a_picture_may_be_is_refused(tmp_path: Path, kind: str):
    """By the number that is given, which is that of the pixels of the largest frame, and no less."""
    first = Image.new("RGB", (WIDTH, HEIGHT), (200, 90, 0))
    first.save(path := tmp_path / f"a.{kind}", save_all=True, append_images=[Image.new("RGB", (WIDTH, HEIGHT))])
    most = WIDTH * HEIGHT
    picture = read_picture(path, most)
    assert read_pages(path, picture, most) is not None
    for read in (lambda: read_picture(path, most - 1), lambda: read_pages(path, picture, most - 1)):
        with pytest.raises(UserError, match=f"more than the limit of {most - 1}"):
            read()


def test_a_frame_that_reaches_beyond_its_gif_counts_with_all_its_pixels(tmp_path: Path):
    numbers = np.zeros((HEIGHT, WIDTH), int)
    data = gif([(0, 0, numbers, 0, None), (0, 0, np.tile(numbers, (2, 1)), 0, None)], np.zeros((8, 3)))
    (path := tmp_path / "a.gif").write_bytes(data)
    picture = read_picture(path)
    assert read_pages(path, picture, 2 * WIDTH * HEIGHT) is not None
    with pytest.raises(UserError, match=f"a frame of it has more than the limit of {2 * WIDTH * HEIGHT - 1} pixels"):
        read_pages(path, picture, 2 * WIDTH * HEIGHT - 1)


@pytest.mark.parametrize("kind", ["png", "gif", "webp"])
def test_frames_of_no_length_are_shown_for_a_tenth_of_a_second(tmp_path: Path, kind: str):
    """As browsers do it."""
    still, *others = [Image.new("RGB", (WIDTH, HEIGHT), (40 * number, 90, 0)) for number in range(3)]
    still.save(path := tmp_path / f"a.{kind}", save_all=True, append_images=others, duration=0)
    clip = read_pages(path, read_picture(path))
    assert clip is not None
    assert (clip.fps, clip.durations, clip.frames) == (10, None, 3)


@pytest.mark.parametrize("frames", [1, 2, 3])
@pytest.mark.parametrize("told", [None, 0, 1, 2, 3, 4])
def test_an_apng_has_as_many_frames_as_it_says(tmp_path: Path, frames: int, told: int | None):
    """With fewer it is damaged; one that says nothing of frames, or of one alone, is a still, as browsers take it."""
    data = encoded([(0, 0, np.full((HEIGHT, WIDTH, 4), 50 * number), 0, 0) for number in range(frames)])
    at = data.index(b"acTL") - 4
    data = data[:at] + (b"" if told is None else chunk(b"acTL", struct.pack(">II", told, 3))) + data[at + 20 :]
    if told is not None and told > max(frames, 1):
        with pytest.raises(ValueError, match=f"^it has {frames} of its {told} frames$"):
            apng.read(data)
        return
    found = apng.read(data)
    assert (found and len(found.frames)) == (told if told is not None and told > 1 else None)


def test_a_png_of_which_the_frames_are_none_is_opened_as_a_still(tmp_path: Path):
    """Also where it tells of them behind its picture, and not before it as PNG has it (third edition, 5.6)."""
    still, *others = [Image.new("RGB", (WIDTH, HEIGHT), (40 * number, 90, 0)) for number in range(3)]
    still.save(path := tmp_path / "a.png", save_all=True, append_images=others)
    data = path.read_bytes()
    at = data.index(b"acTL") - 4
    length = int.from_bytes(data[(picture := data.index(b"IDAT") - 4) : picture + 4], "big")
    told, head, before, after = (
        data[at : at + 20], data[:at], data[at + 20 : picture + 12 + length], data[picture + 12 + length :]
    )  # fmt: skip
    none = chunk(b"acTL", struct.pack(">II", 0, 0))
    for changed in (head + before + after, head + none + before + after, head + before + told + after):
        path.write_bytes(changed)
        source = open_source(path)
        assert (source.clip, source.picture.note, source.picture.pixels[0, 0].tolist()) == (None, "", [0, 90, 0])


def test_a_png_that_tells_of_its_frames_again_behind_its_picture_has_those_that_it_told_of_first(tmp_path: Path):
    still, *others = [Image.new("RGB", (WIDTH, HEIGHT), (40 * number, 90, 0)) for number in range(3)]
    still.save(path := tmp_path / "a.png", save_all=True, append_images=others)
    data = path.read_bytes()
    at = data.index(b"fdAT")
    at = data.rindex(b"fcTL", 0, at) - 4
    for told in (2, 9):
        path.write_bytes(data[:at] + chunk(b"acTL", struct.pack(">II", told, 0)) + data[at:])
        clip = open_source(path).clip
        assert clip is not None
        assert clip.frames == 3


@pytest.mark.parametrize(("count", "told"), [(3, "of its 3 frames none"), (1, "of its 1 frame none")])
def test_the_still_before_an_apng_is_none_of_its_frames(tmp_path: Path, count: int, told: str):
    still, *others = [Image.new("RGB", (WIDTH, HEIGHT), (40 * number, 90, 0)) for number in range(count + 1)]
    still.save(path := tmp_path / "a.png", save_all=True, append_images=others, default_image=True)
    read = read_picture(path)
    assert read.pixels[0, 0].tolist() == [0, 90, 0]
    assert read.note == f"a.png: {told} is used, but the still before them"


def test_a_still_is_no_animation(tmp_path: Path):
    Image.new("RGB", (8, 8)).save(tmp_path / "a.png")
    assert apng.read((tmp_path / "a.png").read_bytes()) is None
