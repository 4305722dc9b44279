"""Pairs of points in files of other programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.errors import UserError
from app.media.landmarks import Pairs, read_pairs, write_pairs

SIZE = 200, 100
PAIRS = np.array([[[0.25, 0.5], [0.3, 0.4]], [[0.1, 0.9], [0.1, 0.85]], [[1 / 3, 2 / 3], [0.4, 0.7]]])
POINTS = Pairs.points(PAIRS)

CSV = "x0,y0,x1,y1\n50,50,60,40\n# a remark\n20;90;20;85\n\n66.66666667\t66.66666667\t80\t70\n"
FROM_PTS = "Version: 1\nn_points: 3\n{\n50.5 50.5\n20.5 90.5\n67.16666667 67.16666667\n}\n"
TO_PTS = "version: 1\r\nn_points:  3\r\n{\r\n60.5 40.5\r\n20.5 85.5\r\n80.5 70.5\r\n}\r\n"
# As tpsDig2 writes it, y from below; the last landmark of each is on a curve.
TPS = (
    "LM=2\n50.00000 50.00000\n20.00000 10.00000\nCURVES=1\nPOINTS=1\n66.66666667 33.33333333\nIMAGE=a.jpg\nID=0\n"
    "LM=2\n60.00000 60.00000\n20.00000 15.00000\nCURVES=1\nPOINTS=1\n80 30\nIMAGE=b.jpg\nID=1\nSCALE=0.004\n"
)


def test_the_same_pairs_are_read_from_every_format(tmp_path: Path) -> None:
    names = {"pairs.csv": CSV, "from.pts": FROM_PTS, "to.pts": TO_PTS, "both.TPS": TPS}
    for name, text in names.items():
        (tmp_path / name).write_bytes(text.encode())
    for given in (["pairs.csv"], ["from.pts", "to.pts"], ["both.TPS"]):
        found = read_pairs([tmp_path / name for name in given], SIZE)
        np.testing.assert_allclose(found.places, PAIRS, atol=1e-10, err_msg=str(given))
        assert found.curves == POINTS.curves


@pytest.mark.parametrize(
    "text",
    [
        "X1,y1, X0 ,y0\n30,40.5,10,20\n",  # the header tells the order
        '"10";"20";"30";"40,5"\n',
        "10,0\t20\t30\t40,5\r\n",
        'curve;x0;y0;x1;y1\n;10;20;30;"40,5"\n',
    ],
)
def test_csv_of_other_programs_is_read(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.csv").write_text(text, encoding="utf-8-sig", newline="")
    np.testing.assert_allclose(read_pairs([tmp_path / "a.csv"], SIZE).places[0] * SIZE, [(10, 20), (30, 40.5)])


FRACTIONS = {
    "a.csv": ("x0,y0,x1,y1\n.5,.5,.6,.4\n.2,1,.2,0\n",),
    "a.pts": ("n_points: 1\n{\n.5 .5\n}\n", "n_points: 1\n{\n1 .4\n}\n"),
    "a.tps": ("LM=2\n.5 .5\n.1 1\nLM=2\n.5 .4\n.3 0\n",),
}


@pytest.mark.parametrize("name", FRACTIONS)
def test_fractions_are_not_taken_for_pixels(tmp_path: Path, name: str) -> None:
    """They all lay in the first pixel, and nothing told why no handle went anywhere."""
    files = [tmp_path / f"{number}{name}" for number, _ in enumerate(FRACTIONS[name])]
    for path, text in zip(files, FRACTIONS[name], strict=True):
        path.write_text(text)
    with pytest.raises(UserError, match=r"within one pixel of the corner.* multiply x by 200 and y by 100$"):
        read_pairs(files, SIZE)
    assert read_pairs(files, (4, 4)).places.max() <= 1
    files[-1].write_text(files[-1].read_text().replace(".4", "1.4"))
    assert len(read_pairs(files, SIZE).places)


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
def test_text_of_two_bytes_a_letter_is_read_by_its_mark(tmp_path: Path, encoding: str) -> None:
    """As Excel's "Unicode Text" is; without the mark nothing tells it from damage."""
    (tmp_path / "a.csv").write_text("\ufeffx0\ty0\tx1\ty1\r\n10\t20\t30\t40,5\r\n", encoding, newline="")
    np.testing.assert_allclose(read_pairs([tmp_path / "a.csv"], SIZE).places[0] * SIZE, [(10, 20), (30, 40.5)])
    (tmp_path / "a.csv").write_bytes((tmp_path / "a.csv").read_bytes()[:-1])
    with pytest.raises(UserError, match="not saved as UTF-8 or UTF-16"):
        read_pairs([tmp_path / "a.csv"], SIZE)


def test_a_long_line_of_spaces_is_told_at_once(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("1,2,3,4\n1" + " " * 500_000 + "x\n")
    with pytest.raises(UserError, match="line 2: expected x0,y0,x1,y1"):
        read_pairs([tmp_path / "a.csv"], SIZE)


@pytest.mark.parametrize("name", ["out.csv", "out.tps"])
def test_pairs_come_back_as_they_were_written(tmp_path: Path, name: str) -> None:
    write_pairs(tmp_path / name, POINTS, SIZE)
    np.testing.assert_allclose(read_pairs([tmp_path / name], SIZE).places, PAIRS, atol=1e-9)


def test_a_pts_file_gets_where_the_points_should_be(tmp_path: Path) -> None:
    write_pairs(tmp_path / "to.pts", POINTS, SIZE)
    words = (tmp_path / "to.pts").read_text().split()
    assert words[:5] == ["version:", "1", "n_points:", "3", "{"]
    assert words[5:] == ["60.5", "40.5", "20.5", "85.5", "80.5", "70.5", "}"]


# A bar of three corners that becomes a straight one of four, and a point by itself before it.
CURVE = """Curve,X0,Y0,X1,Y1
,50,50,60,40
stem,20,20,100,80
stem,20,60,110,80
stem,60,60,,
stem,,,120,80
stem,,,180,80
"""


def test_both_sides_of_a_curve_are_divided_evenly_along_their_lengths(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(CURVE)
    found = read_pairs([tmp_path / "a.csv"], SIZE)
    assert found.curves == ("", *["stem"] * 6)  # 80 pixels, and 16 of them are the most between two points
    np.testing.assert_allclose(found.places[0] * SIZE, [[50, 50], [60, 40]])
    bent = [(20, 20), (20, 36), (20, 52), (28, 60), (44, 60), (60, 60)]
    np.testing.assert_allclose(found.places[1:, 0] * SIZE, bent)
    np.testing.assert_allclose(found.places[1:, 1] * SIZE, [(100 + 16 * k, 80) for k in range(6)])


def test_a_name_that_would_part_its_line_comes_back(tmp_path: Path) -> None:
    names = "a,b", "a;b", '"', "#", "1,5"
    places = np.linspace(0.1, 0.5, 10)[:, None, None] * np.ones((2, 2))
    write_pairs(tmp_path / "out.csv", Pairs(places, tuple(np.repeat(names, 2))), SIZE)
    assert list(dict.fromkeys(read_pairs([tmp_path / "out.csv"], SIZE).curves)) == list(names)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_a_curve_s_name_is_no_number_with_a_decimal_comma(separator: str, tmp_path: Path) -> None:
    rows = "curve;x0;y0;x1;y1\n1,5;10,5;20;30;40\n1,5;12;22;32;42\n"
    (tmp_path / "a.csv").write_text(rows.replace(";", separator))
    found = read_pairs([tmp_path / "a.csv"], SIZE)
    assert set(found.curves) == {"1,5"}
    assert found.places[0, 0, 0] * SIZE[0] == pytest.approx(10.5)


def test_a_closed_curve_has_its_first_place_once(tmp_path: Path) -> None:
    square, far = [(20, 20), (60, 20), (60, 60), (20, 60), (20, 20)], 30
    rows = "".join(f"box,{x},{y},{x + far},{y}\n" for x, y in square)
    (tmp_path / "a.csv").write_text(f"curve,x0,y0,x1,y1\n{rows}")
    found = read_pairs([tmp_path / "a.csv"], SIZE).places * SIZE
    assert len(found) == 10
    np.testing.assert_allclose(found[:4, 0], [(20, 20), (36, 20), (52, 20), (60, 28)])
    np.testing.assert_allclose(found[-1, 0], (20, 36))
    np.testing.assert_allclose(found[:, 1] - found[:, 0], [(far, 0)] * 10, atol=1e-12)


def test_curves_come_back_as_they_were_written(tmp_path: Path) -> None:
    curve = Pairs(np.linspace(0, 0.4, 6)[:, None, None] + [[0.1, 0.2], [0.2, 0.3]], ("",) + ("stem",) * 5)
    write_pairs(tmp_path / "out.csv", curve, SIZE)
    assert (tmp_path / "out.csv").read_text().splitlines()[:3] == [
        "curve,x0,y0,x1,y1",
        ",20,20,40,30",
        "stem,36,28,56,38",
    ]
    found = read_pairs([tmp_path / "out.csv"], SIZE)
    assert found.curves[:2] == curve.curves[:2]
    np.testing.assert_allclose(found.places[[0, 1, -1]], curve.places[[0, 1, -1]], atol=1e-9)


def test_a_closed_curve_comes_back_closed(tmp_path: Path) -> None:
    """It came back open: without the part from its last place to its first."""
    around = np.linspace(0, 2 * np.pi, 13)[:-1]
    ring = 0.5 + 0.2 * np.stack([np.cos(around), np.sin(around)], axis=-1)
    places = np.stack([ring, ring + 0.1], axis=1)
    curves = ("ring",) * 12 + ("", "stem", "stem")
    places = np.concatenate([places, places[:3]])
    write_pairs(tmp_path / "out.csv", Pairs(places, curves, frozenset({"ring"})), SIZE)
    rows = (tmp_path / "out.csv").read_text().splitlines()
    assert rows[1] == rows[13]
    found = read_pairs([tmp_path / "out.csv"], SIZE)
    assert found.closed == {"ring"}
    middles = [found.places[np.array(found.curves) == "ring"].mean(axis=0), places[:12].mean(axis=0)]
    np.testing.assert_allclose(*middles, atol=1e-6)


def test_the_only_point_that_is_left_of_a_curve_is_written_as_a_point(tmp_path: Path) -> None:
    """As where the others lie outside of the picture: a curve of one place cannot be read."""
    places = np.array([[[0.1, 0.2], [0.2, 0.3]], [[0.3, 0.2], [0.4, 0.3]]])
    write_pairs(tmp_path / "out.csv", Pairs(places, ("stem", "ring"), frozenset({"ring"})), SIZE)
    np.testing.assert_allclose(read_pairs([tmp_path / "out.csv"], SIZE).places, places, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.csv", "curve,x0,y0\na,1,2\n", "in any order, and perhaps curve; and not 'curve,x0,y0'"),
        ("a.csv", "curve,x0,y0,x1,y1\n,1,2,,\n", "line 2: expected curve,x0,y0,x1,y1, and not ',1,2,,'"),
        ("a.csv", "curve,x0,y0,x1,y1\na,1,2,3,\n", "line 2: expected curve,x0,y0,x1,y1"),
        ("a.csv", "curve,x0,y0,x1,y1\na,1,2,3,4\n", "the curve 'a' needs two different places on both sides"),
        ("a.csv", "curve,x0,y0,x1,y1\na,1,2,,\na,2,3,,\n", "the curve 'a' needs two different places"),
        ("a.csv", "curve,x0,y0,x1,y1\na,1,2,3,4\na,5,5,3,4\n", "the curve 'a' needs two different places"),
        (
            "a.csv",
            "curve,x0,y0,x1,y1\na,1,2,3,4\na,5,5,6,4\na,1,2,9,9\n",
            "the curve 'a' is closed on one side only",
        ),
        ("a.csv", "1,2,3,4\n1,2,3\n", "line 2: expected x0,y0,x1,y1, and not '1,2,3'"),
        ("a.csv", "1,2,3,4\n1,2,3,x\n", "line 2: expected"),
        ("a.csv", "x0,y0,x1,y1\nx0,y0,x1,y1\n", "line 2: expected"),
        ("a.csv", "1,2,x,4\n1,2,3,4\n", "line 1: expected x0,y0,x1,y1"),
        ("a.pts", "version: 1\nn_points: many\n{\n", "line 2: expected how many points"),
        ("a.csv", "Label,X,Y,Slice\n1,10,20,1\n", "line 1: expected numbers, or the columns x0,y0,x1,y1 in any order"),
        ("a.csv", "10 20 30 40\n", "line 1: expected numbers, or the columns"),
        ("a.csv", "x0,y0,x1,y1,curve,x0\n", "line 1: expected numbers, or the columns"),
        ("a.csv", "10,5;20,5\n", "line 1: expected x0,y0,x1,y1, and not '10,5;20,5'"),
        ("a.csv", "1,2,nan,4\n", "line 1: no pixel lies at"),
        ("a.csv", "1,2,1e9,4\n", "line 1: no pixel lies at"),
        ("a.csv", "x0,y0,x1,y1\n", "has no pairs"),
        ("a.pts", "version: 1\nn_points: 1\n{\n1 2\n}\n", "has one set of landmarks; pairs need two"),
        ("a.pts", "version: 1\nn_points: 2\n{\n1 2\n}\n", "line 5: n_points says 2, and there are 1"),
        ("a.pts", "n_points: 1\n{\n1 2 3\n}\n", "line 3: expected x y"),
        ("a.pts", "n_points: 1\n{\n1 2\n", "ends in the middle"),
        (
            "a.pts",
            "n_points: 1\n{\n1 2\n}\n\nn_points: 1\n{\n3 4\n}\n",
            "line 6: one set of landmarks ends with }, and",
        ),
        ("a.pts", "version: 1\n", "no { before its points"),
        ("a.pts", "hello\n", "line 1: expected version"),
        ("a.tps", "LM=1\n1 2\n", "has one set"),
        ("a.tps", "LM=1\n1 2\nLM=2\n1 2\n3 4\n", "1 landmarks cannot be paired with 2"),
        ("a.tps", "LM=2\n1 2\n", "line 1: 1 more points are announced"),
        ("a.tps", "LM3=2\n1 2 3\n", "line 1: these landmarks are in space"),
        ("a.tps", "LM=many\n", "line 1: expected how many points"),
        ("a.tps", "POINTS=1\n1 2\n", "line 1: points before the first LM="),
        ("a.tps", "ID=1\n1 2\n", "line 2: expected a key"),
        ("a.txt", "1,2,3,4\n", "end with .csv, .pts, .tps"),
    ],
)
def test_what_is_no_file_of_pairs_is_told_by_its_line(tmp_path: Path, name: str, text: str, said: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(UserError) as raised:
        read_pairs([tmp_path / name], SIZE)
    assert said in str(raised.value)
    assert str(tmp_path / name) in str(raised.value)


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"1,\xe9\n")
    with pytest.raises(UserError, match="not text"):
        read_pairs([tmp_path / "a.csv"], SIZE)
