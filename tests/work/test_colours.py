"""Colours and time code of clips through the program, as ffprobe has them."""

from __future__ import annotations

import json
import subprocess
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.errors import UserError
from app.media import ffmpeg
from app.media.displacement import Displacement
from app.media.maps import write_map
from app.media.sequence import PictureSequence
from app.media.video import read_clip
from app.progress import Progress
from app.work.apply_job import Application, MapSource
from app.work.jobs import Outputs
from solver.gl.device import Device

PQ, HLG, WIDE = (
    ("bt2020nc", "bt2020", "smpte2084"),
    ("bt2020nc", "bt2020", "arib-std-b67"),
    ("bt2020nc", "bt2020", "bt709"),
)


def clip(path: Path, colours: tuple[str, str, str], *options: str, rate: str = "24") -> Path:
    matrix, primaries, transfer = colours
    tags = f"setparams=colorspace={matrix}:color_primaries={primaries}:color_trc={transfer}:range=tv"
    command = [ffmpeg.executable(), "-v", "error", "-f", "lavfi", "-i", f"testsrc2=s=64x48:r={rate}:d=0.25"]
    command += ["-vf", f"scale=out_color_matrix={matrix.removesuffix('nc')}:out_range=tv,format=yuv422p10le,{tags}"]
    subprocess.run([*command, "-c:v", "prores_ks", *options, str(path)], check=True)
    return path


def warped(device: Device, source: Path, output: Path, **options: Any) -> tuple[str, ...]:
    write_map(source.with_name("still.npy"), Displacement(np.zeros((48, 64, 2), np.float32)))
    outputs = Outputs(output, **options)
    order = Application(maps=MapSource(source.with_name("still.npy")), picture=source, outputs=outputs)
    return order.perform(lambda: device, Progress()).notices


def probe(path: Path) -> dict[str, Any]:
    command = ["ffprobe", "-v", "error", "-show_streams", "-show_format", "-of", "json", str(path)]
    told = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    (video,) = (stream for stream in told["streams"] if stream["codec_type"] == "video")
    return video | {"tags": told["format"].get("tags", {}) | video.get("tags", {})}


def luma(path: Path) -> np.ndarray:
    """The first frame's, as it is stored."""
    command = [ffmpeg.executable(), "-v", "error", "-i", str(path), "-frames:v", "1", "-f", "rawvideo"]
    told = subprocess.run([*command, "-pix_fmt", "yuv444p10le", "-"], capture_output=True, check=True).stdout
    return np.frombuffer(told, "<u2").reshape(3, 48, 64)[0].astype(float)


@pytest.mark.parametrize("colours", [PQ, HLG, WIDE])
@pytest.mark.parametrize(
    ("ending", "codec"), [(".mov", None), (".mov", "prores-422-hq"), (".mp4", "h265"), (".webm", "av1"), (".mkv", None)]
)
def test_colours_are_kept(
    device: Device, tmp_path: Path, colours: tuple[str, str, str], ending: str, codec: str | None
):
    """And the values with them: none is taken through another curve or matrix on its way."""
    source = clip(tmp_path / "a.mov", colours)
    notices = warped(device, source, tmp_path / f"b{ending}", codec=codec)
    assert any("mixed as if BT.709" in said for said in notices)
    told = probe(tmp_path / f"b{ending}")
    assert (told["color_primaries"], told["color_transfer"]) == (
        colours[1],
        "iec61966-2-1" if ending == ".mkv" and colours is WIDE else colours[2],
    )
    if ending == ".mkv":
        assert told["pix_fmt"] == "gbrp16le"
        return
    assert told["color_space"] == colours[0]
    assert told["pix_fmt"][-4:] in ("10le", "12le")
    assert np.abs(luma(tmp_path / f"b{ending}") - luma(source)).mean() < 12  # of 1023: what the codec loses


@pytest.mark.parametrize(
    ("colours", "name", "codec", "told"),
    [
        (PQ, "b.mp4", None, "BT.2020 PQ, and 8 bits are too few; write .mov"),
        (HLG, "b.webm", None, "BT.2020 HLG, and 8 bits are too few"),
        (PQ, "b.gif", None, r"it cannot tell that the colours of .*a\.mov are BT.2020 PQ; write .mov"),
        (WIDE, "b.%02d.tif", None, "it cannot tell that the colours .* are BT.2020; write"),
    ],
)
def test_what_cannot_hold_the_colours_is_refused(
    device: Device, tmp_path: Path, colours: tuple[str, str, str], name: str, codec: str | None, told: str
):
    source = clip(tmp_path / "a.mov", colours)
    with pytest.raises(UserError, match=told):
        warped(device, source, tmp_path / name, codec=codec)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mov", "still.npy"]


def test_a_png_tells_them(device: Device, tmp_path: Path):
    """By its cICP chunk: primaries 9, transfer 16, RGB, full range."""
    warped(device, clip(tmp_path / "a.mov", PQ), tmp_path / "b.%02d.png")
    data = (tmp_path / "b.00.png").read_bytes()
    assert data[data.index(b"cICP") + 4 :][:4] == bytes([9, 16, 0, 1])
    assert data[24] == 16


@pytest.mark.parametrize("ending", [".mov", ".mp4", ".mkv"])
def test_a_time_code_is_kept(device: Device, tmp_path: Path, ending: str):
    """Of the first frame that is written."""
    source = clip(tmp_path / "a.mov", ("bt709", "bt709", "bt709"), "-timecode", "01:02:03:22")
    assert warped(device, source, tmp_path / f"b{ending}") == () or ending == ".mp4"
    warped(device, source, tmp_path / f"c{ending}", part=(3, None))
    for name, code in (("b", "01:02:03:22"), ("c", "01:02:04:01")):
        tags = {key.lower(): value for key, value in probe(tmp_path / f"{name}{ending}")["tags"].items()}
        assert tags["timecode"] == code
        assert read_clip(tmp_path / f"{name}{ending}").timecode == code


@pytest.mark.parametrize(
    ("rate", "first", "number", "then"),
    [
        ("24", "01:02:03:22", 3, "01:02:04:01"),
        ("25", "23:59:59:24", 1, "00:00:00:00"),
        ("30000/1001", "00:00:59;28", 1, "00:00:59;29"),
        ("30000/1001", "00:00:59;28", 2, "00:01:00;02"),
        ("30000/1001", "00:09:59;29", 1, "00:10:00;00"),
        ("30000/1001", "00:00:00;00", 107892, "01:00:00;00"),
        ("60000/1001", "00:00:59;59", 1, "00:01:00;04"),
    ],
)
def test_time_codes_go_on(rate: str, first: str, number: int, then: str):
    """As SMPTE ST 12-1 counts: an hour of drop-frame code has 107892 frames."""
    made = PictureSequence(
        path=Path("a.%d.png"), width=8, height=8, bits=8, alpha=False, pixel_format="", fps=Fraction(rate),
        timecode=first, files={}, channels=3, max_pixels=64,
    )  # fmt: skip
    assert made.timecode_at(number) == then
