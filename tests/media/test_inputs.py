"""What an enemy hands over: recipes and projects made to cost much, and names made to be obeyed by a terminal."""

from __future__ import annotations

import errno
import io
import json
import os
import random
import re
import struct
import subprocess
import sys
import tomllib
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
import tifffile
from PIL import Image

from app.errors import MOST_SHOWN, UserError, printable, shown
from app.media.codecs.decoding import decoding
from app.media.inputs import cannot_read, open_input, read_input
from app.media.maps import holds, read_map
from app.media.pictures import read_picture, write_picture
from app.media.project import is_project, load
from app.media.recipes import read_recipe
from app.media.source import open_source
from app.media.video import read_clip
from app.model import toml
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.model.schema import frozen
from app.ui.preferences import Preferences
from support.commands import Run

ROOT = Path(__file__).parents[2]
MOST_MEMORY = 300 * 2**20  # bytes, beside what the program has before it opens a file
PATIENCE = 60  # seconds for each file; they take milliseconds, and a fault hours

# Opens each file as the command line does, with so little memory that a fault ends it, and says what became of them.
OPENING = f"""
import json, resource, signal, sys
from pathlib import Path
import imagecodecs, tifffile, PIL.Image, OpenEXR
from app.errors import UserError
from app.media.opening import open_recipe

pages = int(Path("/proc/self/statm").read_text().split()[0])
most = pages * resource.getpagesize() + {MOST_MEMORY}
resource.setrlimit(resource.RLIMIT_AS, (most, most))
said = {{}}
for name in sys.argv[1:]:
    print(name, file=sys.stderr, flush=True)
    signal.alarm({PATIENCE})
    try:
        open_recipe(name)
        said[name] = ""
    except UserError as error:
        said[name] = str(error)
print(json.dumps(said))
"""


def opened(paths: list[Path]) -> dict[str, str]:
    """What was said of each: "" where it was taken."""
    command = [sys.executable, "-c", OPENING, *map(str, paths)]
    ran = subprocess.run(command, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr[-3000:]
    said: dict[str, str] = json.loads(ran.stdout)
    assert list(said) == [str(path) for path in paths]
    for sentence in said.values():
        assert len(sentence) <= 10 * MOST_SHOWN  # its escapes are longer than what they stand for
        assert sentence.isprintable()
    return said


# Recipes ------------------------------------------------------------------------------------------------------------


def many(word: str, most: int, dice: random.Random) -> str:
    """`word` a few times, or thousands of times, but no more than `most` characters of it."""
    return word * max(1, min(most // len(word), int(10 ** dice.uniform(0, 5))))


def hostile_text(dice: random.Random, most: int = 100_000) -> str:
    """A TOML file of what costs parsers much, of what no recipe holds, and of what one does hold."""
    text = ""
    while len(text) < most and dice.random() < 0.8:
        text += dice.choice(PIECES)(dice, most - len(text)) + dice.choice(["\n", "\r\n", "\n\n", " ", ""])
    if dice.random() < 0.3:  # cut off, or with another piece in the middle of one
        at = dice.randrange(len(text) + 1)
        text = text[:at] + dice.choice(["", hostile_text(dice, 1000)])
    return text[:most]


def key(dice: random.Random, most: int) -> str:
    part = dice.choice(["a", "stroke", "fluid", '"a.b"', "'\"'", '""', "1", "-", "\u00e9"])
    joint = dice.choice([".", " . ", "\t.", ".."])
    return dice.choice([part, many(part + joint, most, dice) + part, many("k", most, dice)])


def value(dice: random.Random, most: int) -> str:
    number = dice.choice(
        ["0", "-1", "1.5", "1e999", "nan", "-inf", "9" * 5000, "0x" + "f" * 5000, "1_0", "1e" + "9" * 99]
    )
    escape = dice.choice(
        ["\\u0000", "\\u001b[31m", "\\u202e", "\\n", "\\\\", '\\"', "\\U0010ffff", "\\ud800", "x", "\u0007"]
    )
    return dice.choice(
        [
            number,
            many(dice.choice("0123456789"), most, dice),
            '"' + many(escape, most, dice) + dice.choice(['"', ""]),
            dice.choice(['"""', "'''"]) + many(dice.choice(['\\"', '"', "'", '""a', "[a.b]\n"]), most, dice) + '"""',
            many("[", most, dice) + number + many("]", most, dice),
            many("{a=", most, dice) + number + many("}", most, dice),
            many("[" + " " * 50, most, dice),
            "[" + many(dice.choice(["0,", "[],", "{},", "[0, 0.5, 0.5, 1.0],", "[[[0]]],", "''," ]), most, dice) + "]",
            dice.choice(["1979-05-27T07:32:00Z", "0000-00-00", "25:61:61", "1979-13-41", "true", "tru"]),
        ]
    )  # fmt: skip


def table(dice: random.Random, most: int) -> str:
    head = dice.choice(["[{}]", "[[{}]]", "[{}", "[[{}]"]).format(key(dice, most // 2))
    return many(head + "\n", most, dice)


def known(dice: random.Random, most: int) -> str:
    """Something that a recipe does hold, its values wrong, or far too much of it."""
    name = dice.choice(["picture", "map", "name", "duration", "version", "edges", "mode", "stroke", "force", "fluid"])
    formula = many(
        dice.choice(["~", "-", "(", "not ", "1+", "sin(", "[", "1 is 1 or ", "'", "t**", "9**", "0_"]), 499, dice
    )
    inner = f'kind = "point"\npoint = [0.5, 0.5]\ndirection = [1, 0]\nformula = "{formula}1"'
    return dice.choice(
        [
            f"{name} = {value(dice, most)}",
            f"[[force]]\n{inner}",
            many(f"[[stroke]]\ntool = 'push'\nsamples = [[{dice.randrange(9)}, 0.5, 0.5, 1.0]]\n", most, dice),
            f"[[viscosity]]\nkind = 'picture'\npicture = {value(dice, most)}",
            f"[[viscosity]]\nkind = 'constant'\nwindow = {value(dice, most)}\n",
            many("#", most, dice),
            "picture = '/dev/zero'",
        ]
    )


PIECES: list[Callable[[random.Random, int], str]] = [
    lambda dice, most: f"{key(dice, most)} = {value(dice, most)}",
    lambda dice, most: "".join(f"k{number} = 0\n" for number in range(min(most // 10, int(10 ** dice.uniform(0, 4))))),
    table,
    known,
    known,
]


@pytest.mark.parametrize("seed", range(2))
def test_hostile_recipes_are_taken_or_refused_in_a_sentence(tmp_path: Path, seed: int):
    """Within the memory; and never in more than the time that such a length may take."""
    dice = random.Random(seed)
    paths = []
    for number in range(150):
        data = hostile_text(dice).encode("utf-8", "surrogatepass")
        if dice.random() < 0.1:
            data = b"\xef\xbb\xbf" + data + bytes([dice.randrange(256)])
        paths.append(tmp_path / f"{number}.toml")
        paths[-1].write_bytes(data)
    said = opened(paths)
    assert any(said.values())
    assert not all(said.values())
    for path, sentence in said.items():
        assert not sentence or Path(path).name in sentence


SMALL_AND_HARMFUL = {
    "dotted key": ("a" + ".a" * 10_000 + " = 1", "line 1: a key of more than 16 parts"),
    "dotted key with spaces": ("a" + " . 'a'" * 10_000 + " = 1", "line 1: a key of more than 16 parts"),
    "dotted header": ("\n[" + "a." * 10_000 + "a]", "line 2: a key of more than 16 parts"),
    "longer": ("a" + ".a" * 50_000 + " = 1", "line 1: a key of more than 16 parts"),
    "arrays": ("a = " + "[" * 5000 + "]" * 5000, "line 1: lists or tables nested more than 16 deep"),
    "tables": ("a = " + "{a=" * 5000 + "1" + "}" * 5000, "line 1: lists or tables nested more than 16 deep"),
    "number": ("\n\nduration = " + "9" * 5000, "line 3: a number or a key of 5000 characters"),
    "key": ("x" * 100_000 + " = 1", "line 1: a number or a key of 100000 characters"),
    "text": (f"name = '{'x' * 100_000}'", "line 1: a text of 100002 characters"),
    "quoted key": (f"'{'x' * 9000}' = 1", "unknown key"),
    "NUL": ('picture = "a\\u0000b.png"', "line 1: picture: no file has a NUL in its name"),
    "NUL in a layer": ('[[viscosity]]\nkind = "picture"\npicture = "\\u0000"', "no file has a NUL in its name"),
    "no such date": ("name = 2024-13-41", "is not valid TOML"),
    "unclosed quotes": ('name = "' + '\\"' * 50_000, "is not valid TOML"),
    "spaces in a list": ("nope = [\n[" + " " * 99_000 + "\n]]", "line 1: unknown key 'nope'"),
    "texts without an end": ('a = """\\""\n' + '\\"""\\""\n' * 140_000, "is not valid TOML: Unterminated string"),
    "faulty tables": ("force = [" + "{}," * 60_000 + "]", "line 1: force[1]: 'kind' must be one of"),
    "faulty lists": ("force = [" + "[1]," * 250_000 + "]", "line 1: 'force[1]' must be a table"),
    "faulty samples": (
        "[[stroke]]\ntool = 'push'\nsamples = [" + "[1]," * 250_000 + "]",
        "line 3: stroke[1]: 'samples[1][2]' is missing",
    ),
    "tables in plenty": ("nope = [" + "{}," * 1_000_000 + "]", "line 1: the 200001th of its keys, values and brackets"),
    "keys in plenty": ("".join(f"a{key} = 1\n" for key in range(200_000)), "of its keys, values and brackets"),
    "forces": (
        "[[force]]\nkind = 'point'\npoint = [0, 0]\ndirection = [1, 0]\n" * 513,
        "there are 513 forces; at most 512 work",
    ),
    "thin curve": (
        "[[force]]\nkind = 'curve'\nradius = 1e-300\npoints = [[0, 0], [9, 9]]",
        "line 1: force[1]: 'radius' (1e-300) is too small for so long a curve",
    ),
    "wide curve": (
        "[[force]]\nkind = 'curve'\nradius = 0.2\npoints = [" + "[0, 0.5], [1, 0.5], " * 240 + "]",
        "the pieces of the forces' curves, eight a radius, cover the whole picture 3142 times",
    ),
    "wide soft curve": (
        "[[force]]\nkind = 'curve'\nradius = 0.2\nfalloff = 'gaussian'\npoints = ["
        + "[0, 0.5], [1, 0.5], " * 240
        + "]",
        "the pieces of the forces' curves, eight a radius, cover the whole picture 19640 times",
    ),
    "curves": (
        ("[[force]]\nkind = 'curve'\nradius = 0.01\npoints = [" + "[0, 0.5], [1, 0.5], " * 12 + "]\n") * 100,
        "the curves of the forces are cut into 1842400 pieces",
    ),
    "strokes at once": (
        "[[stroke]]\ntool = 'push'\nsamples = [[0, 0.1, 0.2, 1.0], [1, 0.2, 0.2, 1.0]]\n" * 9000,
        "9000 strokes act at once in tick 0",
    ),
    "strokes again and again": (
        (
            "[[stroke]]\ntool = 'push'\nrepeat = 1000\nevery = 1\nsymmetry = 'radial'\nsectors = 16\n"
            "samples = [[0, 0.1, 0.2, 1.0], [1, 0.2, 0.2, 1.0]]\n"
        )
        * 6000,
        "24000 pieces of strokes act at once in tick 1, with their repetitions",
    ),
    "images at once": (
        (
            "[[stroke]]\ntool = 'bloat'\ndetail = 600\nsymmetry = 'radial'\nsectors = 16\n"
            "samples = [[0, 0.1, 0.2, 1.0]]\n"
        )
        * 63,
        "1008 pieces of strokes act at once in tick 0",
    ),
    "images that are pushed": (
        "[[stroke]]\ntool = 'push'\nsymmetry = 'radial'\nsamples = [[0, 0.1, 0.2, 1.0], [0, 0.2, 0.2, 1.0]]\n" * 501,
        "1002 pieces of strokes act at once in tick 0",
    ),
    "images that are pushed nearby": (
        (
            "[[stroke]]\ntool = 'push'\ndetail = 600\nsymmetry = 'radial'\nsectors = 16\n"
            "samples = [[0, 0.1, 0.2, 1.0], [0, 0.2, 0.2, 1.0]]\n"
        )
        * 63,
        "1008 pieces of strokes act at once in tick 0",
    ),
    "samples at once": (
        "[[stroke]]\ntool = 'restore'\nsamples = [" + "[0, 0.1, 0.2, 1.0], [0, 0.8, 0.2, 1.0], " * 300 + "]\n"
        "[[stroke]]\ntool = 'curve'\nsamples = [" + "[0, 0.1, 0.2, 1.0], [0, 0.8, 0.2, 1.0], " * 300 + "]\n",
        "1199 pieces of strokes act at once in tick 0",
    ),
    "keys of a handle": (
        "[[handle]]\nat = [0.5, 0.5]\nkeys = ["
        + "".join(f"[{key}, 0.5, 0.5], " for key in range(200_000))
        + "]\n",
        "",
    ),
    "a hand that rests": (
        "[[mask]]\nkind = 'stroke'\ntool = 'thicken'\n"
        "samples = [[0, 0.5, 0.5, 1.0], [10000000, 0.5, 0.5, 1.0]]",
        "mask[1]: paints for 10000000 ticks of the hand",
    ),
    "formula": (
        "[[force]]\nkind = 'point'\npoint = [0, 0]\ndirection = [1, 0]\nformula = '" + "~" * 499 + "1'",
        "not allowed in a formula",
    ),
}  # fmt: skip


def test_what_was_once_an_accident(tmp_path: Path):
    paths = [tmp_path / f"{name}.toml" for name in SMALL_AND_HARMFUL]
    for path in paths:
        path.write_text(SMALL_AND_HARMFUL[path.stem][0])
    for name, sentence in opened(paths).items():
        assert SMALL_AND_HARMFUL[Path(name).stem][1] in sentence


def test_samples_are_no_words() -> None:
    """Lists of numbers count as one, or a project of six minutes would not open again."""
    samples, pairs = "[100, 0.25, -0.5, 1.0], [101, 1e-3, 0.5, 1], ", toml.MOST_WORDS // 8
    assert len(toml.parsed(f"samples = [{samples * pairs}]", "a.toml")["samples"]) == 2 * pairs


def test_lines_of_nothing_are_counted() -> None:
    assert toml.parsed("\n" * toml.MOST_LINES, "a.toml") == {}
    with pytest.raises(
        UserError, match=r"^a\.toml has more than 500000 lines, more than any recipe needs; get it again"
    ):
        toml.parsed("\n" * (toml.MOST_LINES + 1), "a.toml")


@pytest.mark.parametrize(
    ("table", "key", "most", "said"),
    [
        ("[[freeze]]\nkind = 'path'", "points", 20_000, "path has 20001 points"),
        ("[[viscosity]]\nkind = 'path'\nscale = 2", "points", 20_000, "path has 20001 points"),
        (
            "[[mask]]\ntick = 0\nkind = 'fill'\nof = 'frozen'\namount = 1",
            "outline",
            50_000,
            "outline has 50001 corners",
        ),
    ],
)
def test_points_of_a_path_and_corners_are_counted(table: str, key: str, most: int, said: str) -> None:
    def recipe(count: int) -> Recipe:
        return Recipe.parse(f"version = 5\n{table}\n{key} = [{'[0.5, 0.25],' * count}]\n")

    assert recipe(most).version == 5
    with pytest.raises(UserError, match=rf"its {said}; at most {most} work"):
        recipe(most + 1)


@pytest.mark.parametrize("mark", ["=", "] \t"])
def test_marks_are_counted_that_stand_between_nothing(mark: str) -> None:
    """Each costs as much as a word; 64 MB of them took 40 s."""
    text = f"a = 1\n{mark * (toml.MOST_MARKS + 1)}"
    with pytest.raises(UserError, match=r"^a\.toml, line 2: the 600001th of its commas, dots, signs of equality and"):
        toml.parsed(text, "a.toml")


def test_marks_between_words_are_not_too_many() -> None:
    lists = toml.MOST_WORDS - 9
    assert len(toml.parsed(f"a = [\n{'[],' * lists}\n]", "a.toml")["a"]) == lists


@pytest.mark.parametrize("quotes", ['"', "'''", '"""'])
def test_a_text_without_an_end_is_not_read_to_its_end(quotes: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The parser takes 2 s for each 10 MB of backslashes."""
    given: list[str] = []
    loads = tomllib.loads
    monkeypatch.setattr(tomllib, "loads", lambda text: given.append(text) or loads(text))
    with pytest.raises(UserError, match=r"^a\.toml is not valid TOML: (Unterminated string|Expected \"'''\")"):
        toml.parsed(f"a = 1\nb = {quotes}" + "\\\\" * 100_000, "a.toml")
    assert given[0].startswith(f"a = 1\nb = {quotes}")
    assert len(given[0]) < 2 * toml.LONGEST_STRING


ROWS = {
    "samples": "a = [{row}]",
    "with others": "a = [ [1, 2], 'b', {row}, {{c = [{row}, []]}}, [[{row}]] ]  # [[{row}]]",
    "over lines": "a = [\n{row},\n{row} ,\n]\n[[b]]\nc = [[{row}], [{row}]]",
    "in a text": 'a = \'[{row}]\'\nb = """[{row}\n{row}]"""',
    "in an empty list": "a = [{row},]",
    "marked": "a = [{{'\ue0000' = 0}}, {row}]",
    "marked by an escape": 'a = [{{"\\uE0000" = 0}}, {row}]',
    "no list": "a = {row}",
    "no commas": "a = [{row} {row}]",
    "a header": "[{row}]\nb = 1",
    "unclosed": "a = [{row}",
    "a mistake after it": "a = [{row}, 1.]\nb = 2",
}
OTHERWISE = ("a header", "no commas")  # the mistake that the parser comes to first may be another
NUMBERS = ["[0, 0.1, -0.25, 1.0]", "[100, 1e-3, 1E5, -0]", "[1_0, +0.5, 0, 1]", "[01, 0, 0, 1]", "[1e999, 9, 9, 9]"]


@pytest.mark.parametrize("shape", ROWS)
@pytest.mark.parametrize("numbers", NUMBERS)
def test_long_rows_of_numbers_are_read_as_short_ones(shape: str, numbers: str) -> None:
    """As the standard library reads them, of whose time they would take nearly all; or refused as it refuses them."""
    text = ROWS[shape].format(row=", ".join([numbers] * 90))
    try:
        expected = frozen(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        said = re.escape(f"a.toml is not valid TOML: {error}".partition(" (at line")[0])
        with pytest.raises(UserError, match=r"a\.toml is not valid TOML" if shape in OTHERWISE else said):
            toml.parsed(text, "a.toml")
    else:
        assert repr(frozen(toml.parsed(text, "a.toml"))) == repr(expected)


def test_samples_are_no_work_for_the_parser(monkeypatch: pytest.MonkeyPatch) -> None:
    """It takes 20 microseconds for each number: half a minute for a day's painting."""
    given: list[str] = []
    loads = tomllib.loads
    monkeypatch.setattr(tomllib, "loads", lambda text: given.append(text) or loads(text))
    told = toml.parsed(f"a = 1\n[[stroke]]\nsamples = [{'[1, 0.5, 0.25, 1.0], ' * 1000}]", "a.toml")
    assert told["stroke"][0]["samples"] == ((1, 0.5, 0.25, 1.0),) * 1000
    assert len(given[0]) < 100
    row = "[0,0,0,0]," * 50_000
    with pytest.raises(UserError, match=r"a\.toml, line 2: more than 2000000 numbers in lists"):
        toml.parsed(f"a = [{row}\n{row * 10}]", "a.toml")


def test_what_recipes_hold_is_looked_through_and_taken():
    """Every shipped recipe, and nesting, texts and dots up to what is allowed."""
    for path in [*ROOT.glob("assets/recipes/*.toml"), *ROOT.glob("assets/gallery/*.toml")]:
        toml.parsed(path.read_text("utf-8"), path.name)
    inside = '"' + r"a.b\"[[{" * 100 + '"'
    deepest = "[" * toml.DEEPEST + "1" + "]" * toml.DEEPEST
    text = f"""
a{".b" * (toml.MOST_PARTS - 1)} = 1.5 # [[[[[[[[[[[[[[[[[[[[[[[ a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q.r.s.t.u
c = {deepest}
d = {inside}
e = [[1, 0.1, 0.2, 1.0], [2, 1e-3, -0.25, 1], ]
f = '''{"[" * 99}'''
g = \"\"\"{"{" * 99}\\\"\"\"\"\"\"
[[h.i]]
[[h.i]]
j = 2024-01-02T03:04:05.678Z
"""
    told = toml.parsed(text, "a.toml")
    assert told["e"] == [[1, 0.1, 0.2, 1.0], [2, 1e-3, -0.25, 1]]
    assert told["g"] == "{" * 99 + '"""'
    assert len(told["h"]["i"]) == 2


# Projects -----------------------------------------------------------------------------------------------------------

PLAIN = 'version = 1\npicture = "a.png"\n'


def packed(members: dict[str, bytes], how: int = zipfile.ZIP_DEFLATED) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", how, compresslevel=1) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return data.getvalue()


def lying_project(members: dict[str, bytes], size: int) -> bytes:
    """A project whose recipe unpacks to `size` bytes, a whole number of MB, and to 99 by its index."""
    packer = zlib.compressobj(1, zlib.DEFLATED, -zlib.MAX_WBITS)
    block = packer.compress(b"#" * 2**20) + packer.flush(zlib.Z_FULL_FLUSH)
    recipe = block * (size >> 20) + packer.flush()
    others = {name: content for name, content in members.items() if name != "recipe.toml"}
    data = bytearray(packed({**others, "recipe.toml": recipe}, zipfile.ZIP_STORED))
    index = data.rfind(b"PK\1\2")
    struct.pack_into("<H", data, index + 10, zipfile.ZIP_DEFLATED)
    struct.pack_into("<I", data, index + 24, 99)
    return bytes(data)


def hostile_project(dice: random.Random, picture: bytes) -> bytes:
    """A project whose members are not what they seem."""
    members = {"format.txt": b"fluidwarp project 1\n", "recipe.toml": PLAIN.encode(), "a.png": picture}
    name = dice.choice(list(members))
    match dice.randrange(6):
        case 0:  # a bomb in one of its members
            members[name] = dice.choice([b"\0", b"#", b"[a]\n", b"x"]) * int(10 ** dice.uniform(0, 7))
        case 1:
            members["recipe.toml"] = hostile_text(dice).encode("utf-8", "surrogatepass")
        case 2:
            inside = dice.choice(
                ["b\\u0000", "../a.png", "a/../../b.png", "/etc/passwd", "x" * 5000, "recipe.toml", "a\\u001b.png"]
            )
            members["recipe.toml"] = f'picture = "{inside}"'.encode()
            members[inside.replace("\\u0000", "\0").replace("\\u001b", "\x1b")] = picture
        case 3:
            members |= {f"{number}": b"" for number in range(dice.randrange(1000))}
        case 4:
            members["format.txt"] = dice.choice(
                [b"", b"fluidwarp project", b"fluidwarp project " + b"9" * 5000, b"\xff"]
            )
        case _:
            pass
    ways = [zipfile.ZIP_DEFLATED, zipfile.ZIP_STORED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA]
    small = sum(map(len, members.values())) < 2**20  # or making it would take longer than reading it
    data = packed(members, dice.choice(ways if small else ways[:1]))
    if dice.random() < 0.5:  # its index lies about a size, a place, a way of compression, a flag ...
        index = data.rfind(b"PK\1\2", 0, dice.choice([data.find(b"PK\5\6"), len(data)]))
        at = index + dice.choice([8, 10, 16, 20, 24, 28, 42]) if dice.random() < 0.8 else data.rfind(b"PK\5\6") + 12
        lie = struct.pack("<I", dice.choice([0, 1, 99, 0x7FFFFFFF, 0xFFFFFFFF, dice.randrange(2**32)]))
        data = data[:at] + lie + data[at + 4 :]
    return data


@pytest.fixture
def picture(tmp_path: Path) -> bytes:
    write_picture(tmp_path / "picture.png", Picture(np.zeros((48, 64, 3), np.uint8)))
    return (tmp_path / "picture.png").read_bytes()


def test_hostile_projects_are_taken_or_refused_in_a_sentence(tmp_path: Path, picture: bytes):
    dice = random.Random(0)
    paths = []
    for number in range(30):
        paths.append(tmp_path / f"{number}.fluidwarp")
        paths[-1].write_bytes(hostile_project(dice, picture))
    said = opened(paths)
    assert any(said.values())
    assert not all(said.values())
    for path, sentence in said.items():
        assert not sentence or Path(path).name in sentence


def test_a_project_unpacks_to_no_more_than_a_few_times_its_size(tmp_path: Path, picture: bytes):
    """By its index, and whatever its index says."""
    members = {"format.txt": b"fluidwarp project 1 ", "recipe.toml": PLAIN.encode(), "a.png": picture}
    made = {
        "plain": packed(members),
        "recipe": packed(members | {"recipe.toml": members["recipe.toml"] + b"#" * 2**24}),
        "picture": packed(members | {"a.png": picture + b"#" * 2**24}),
        "lying": lying_project(members, 2**29),
    }
    paths = [tmp_path / f"{name}.fluidwarp" for name in made]
    for path, data in zip(paths, made.values(), strict=True):
        assert len(data) < 2**22
        path.write_bytes(data)
    assert [bool(sentence) for sentence in opened(paths).values()] == [False, True, True, True]


def test_a_project_is_packed_as_projects_are(tmp_path: Path, picture: bytes):
    """In other ways a step of unpacking may give any number of bytes."""
    members = {"format.txt": b"fluidwarp project 1 ", "recipe.toml": PLAIN.encode(), "a.png": picture}
    ways = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
    paths = [tmp_path / f"{how}.fluidwarp" for how in ways]
    for path, how in zip(paths, ways, strict=True):
        path.write_bytes(packed(members, how))
    assert [bool(sentence) for sentence in opened(paths).values()] == [False, False, True, True]


# Files --------------------------------------------------------------------------------------------------------------


@pytest.fixture(params=["a pipe", "a device", "a socket"])
def endless(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[str], Path]:
    """Makes something of any name whose reading never ends."""

    def make(name: str) -> Path:
        path = tmp_path / name
        if request.param == "a pipe":
            os.mkfifo(path)
        elif request.param == "a device":
            path.symlink_to("/dev/zero")
        else:
            import socket

            with socket.socket(socket.AF_UNIX) as server:
                server.bind(str(path))
        return path

    return make


READERS: dict[str, Callable[[Path], object]] = {
    "a.toml": read_recipe,
    "a.fluidwarp": load,
    "a.png": read_picture,
    "a.mp4": read_clip,
    "a.flo": read_map,
    "a.npy": read_map,
    "a.exr": read_map,
    "a.tif": read_map,
}


@pytest.mark.parametrize("name", READERS)
def test_only_ordinary_files_are_opened(endless: Callable[[str], Path], name: str):
    path = endless(name)
    with pytest.raises(UserError, match=rf"Cannot read {path}: it is a pipe or a device; save it as an ordinary file"):
        READERS[name](path)
    assert holds(path) in ("picture", "map")
    assert is_project(path) == (path.suffix == ".fluidwarp")


@pytest.mark.parametrize("name", READERS)
def test_a_file_that_cannot_be_read_to_its_end_is_told(tmp_path: Path, name: str):
    """As on a bad disk: the first page of a process's memory is never there."""
    path = tmp_path / name
    path.symlink_to("/proc/self/mem")
    with pytest.raises(UserError, match=f"{path}"):
        READERS[name](path)
    assert holds(path) in ("picture", "map")
    assert is_project(path) == (path.suffix == ".fluidwarp")


@pytest.mark.skipif(sys.platform == "win32", reason="links are made otherwise there")
def test_what_cannot_be_opened_is_told_with_the_mend(tmp_path: Path):
    (loop := tmp_path / "loop.png").symlink_to(loop)
    (file := tmp_path / "file.png").touch()
    for path, said in {
        loop: "it is a link that leads back to itself; give the name of the file.",
        tmp_path / ("x" * 300 + ".png"): "the name is too long; check it.",
        file / "a.png": "a part of its path is a file; check the name.",
        Path("http://example.org/a.png"): "it is an address, and only files are read; download it first.",
        Path("C:/gone.png"): "there is no such file; check the name.",
    }.items():
        with pytest.raises(UserError) as error:
            read_picture(path)
        assert str(error.value) == f"Cannot read {path}: {said}"


def test_a_file_that_is_there_is_no_address_whatever_it_is_called() -> None:
    said = str(cannot_read("http://example.org/a.png", OSError(errno.EACCES, "")))
    assert said == "Cannot read http://example.org/a.png: no permission to read it; change its permissions."


def test_files_are_of_a_bounded_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "a.toml"
    with path.open("wb") as stream:
        stream.truncate(10 * 2**40)  # on the disk it takes nothing
    with pytest.raises(UserError, match=rf"{path}: it has more than 64 MB, the most that a recipe may have"):
        read_recipe(path)
    with pytest.raises(UserError, match="has more than 5 bytes"):
        read_input(path, "file", 5)
    # One that tells a size of 0, and goes on.
    with pytest.raises(UserError, match="has more than 5 bytes"):
        read_input("/proc/self/status", "file", 5)
    assert read_input("/proc/self/comm", "file", 99)
    with pytest.raises(UserError, match="there is no such file"):
        open_input(tmp_path / "none")
    with pytest.raises(UserError, match="no file has a NUL in its name"):
        open_input("a\0b")
    with pytest.raises(UserError, match="it is a folder; give the name of a picture"):
        open_input(tmp_path, "picture")
    flo = tmp_path / "a.flo"
    with flo.open("wb") as stream:
        stream.write(struct.pack("<fii", 202021.25, 30_000, 30_000))
        stream.truncate(12 + 30_000**2 * 8)
    with pytest.raises(UserError, match="30000 x 30000 pixels are more than the limit"):
        read_map(flo)
    npy = tmp_path / "a.npy"
    np.save(npy, np.zeros((2, 2, 2)))
    npy.write_bytes(npy.read_bytes().replace(b"(2, 2, 2), }  ", b"(9, 999, 2), }")[:200])
    with pytest.raises(UserError, match="it is truncated"):
        read_map(npy)
    npy.write_bytes(npy.read_bytes().replace(b"(9, 999, 2)", b"(-1, -1, 2)"))
    with pytest.raises(UserError, match="is empty"):
        read_map(npy)


def test_a_pipe_that_takes_a_files_place_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "a"
    path.touch()
    opened = os.open

    def swap(name: str | Path, flags: int, *others: int) -> int:
        path.unlink()
        os.mkfifo(path)
        return opened(name, flags, *others)

    monkeypatch.setattr(os, "open", swap)
    with pytest.raises(UserError, match="a pipe or a device"):
        open_input(path)


@pytest.mark.parametrize(("kind", "said"), [("large", "has more than 5 bytes"), ("pipe", "a pipe or a device")])
def test_what_was_opened_is_looked_at_and_not_what_has_its_name_by_then(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, said: str
):
    path, other, opened = tmp_path / "a", tmp_path / kind, os.open
    path.write_bytes(b"small")
    if kind == "pipe":
        os.mkfifo(other)
    else:
        other.write_bytes(b"larger")
    monkeypatch.setattr(os, "open", lambda name, flags, *others: opened(other, flags, *others))
    with pytest.raises(UserError, match=said):
        open_input(path, most=5)


@pytest.mark.parametrize("text", ["[" * 100_000, '{"scale": NaN}', '{"recent": 5}', "[]", "\0", "9" * 5000])
def test_preferences_that_are_hostile_are_as_by_default(tmp_path: Path, text: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    path = tmp_path / "fluidwarp/preferences.json"
    path.parent.mkdir()
    path.write_text(text)
    assert Preferences.load() == Preferences()
    path.unlink()
    os.mkfifo(path)
    assert Preferences.load() == Preferences()


# Messages -----------------------------------------------------------------------------------------------------------


def test_what_is_long_lacks_its_middle():
    assert shown("a" * 600 + "b" * 5000 + "c" * 600) == "a" * 500 + " ... " + "c" * 500
    assert shown("a" * 1000) == "a" * 1000


def test_what_is_shown_is_one_line_that_no_terminal_obeys():
    assert shown("Grüße, 你好 👩‍🚀: \\") == "Grüße, 你好 👩‍🚀: \\"  # as it is
    assert shown("a\x1b[31m\n\t\r\0\x7f\x9b\u202e\u2028\udcff") == (r"a\x1b[31m\n\t\r\x00\x7f\x9b\u202e\u2028\udcff")
    assert str(UserError("\x1b]0;title\x07")) == r"\x1b]0;title\x07"
    assert printable("Grüße, 你好 👩‍🚀 \u200eא: \\") == "Grüße, 你好 👩‍🚀 \u200eא: \\"  # as it is
    assert printable("a\n\t\0\x1b\x7f\x9b\u2028\u2029\udcff b") == "a????????? b"
    long = str(UserError(f"Cannot read {'x' * 100_000}: there is no such file; check the name."))
    assert len(long) < MOST_SHOWN + 10
    assert re.fullmatch(r"Cannot read x+ \.\.\. x+: there is no such file; check the name\.", long)


def test_names_reach_the_terminal_escaped_and_shortened(tmp_path: Path, fluidwarp: Run):
    """In errors, in notices and in the lines of a batch."""
    name = "\x1b[31mred\nline\u202e"
    (tmp_path / "a.toml").write_text(
        'duration = 0.02\n[fluid]\ngrid = 16\n[[viscosity]]\nkind = "picture"\n'
        'picture = "\\u001b[31mred\\nline\\u202e.png"\nscale = 1\n'
    )
    write_picture(tmp_path / f"{name}.png", Picture(np.zeros((24, 32, 3), np.uint8)))
    write_picture(tmp_path / "cat.png", Picture(np.zeros((48, 64, 3), np.uint8)))

    escaped = r"\x1b[31mred\nline\u202e"
    ran = fluidwarp(tmp_path, "render", "a.toml", "-i", "cat.png", "-o", "out.png")
    assert ran.stderr == f"fluidwarp: {escaped}.png is 32 x 24 and the picture 64 x 48: scaled to fit it\n"
    ran = fluidwarp(tmp_path, "render", "a.toml", "cat.png", f"{name}.gone.png", "-o", "out")
    assert ran.returncode == 1
    assert ran.stderr.splitlines() == [
        f"fluidwarp: cat.png: {escaped}.png is 32 x 24 and the picture 64 x 48: scaled to fit it".replace(
            "cat.png", str(tmp_path / "cat.png"), 1
        ),
        f"fluidwarp: Cannot read {tmp_path}/{escaped}.gone.png: there is no such file; check the name.",
        "fluidwarp: 1 of 2 pictures failed; all others are written",
    ]
    ran = fluidwarp(tmp_path, "render", "x" * 100_000, "-o", "out.png")
    assert ran.returncode == 1
    assert len(ran.stderr) < MOST_SHOWN + 50


TOO_LONG = [
    ["-o", "o" * 300 + ".png"],
    ["-o", "o.png", "--states", "s" * 300],
    ["-o", "o.mp4", "--frames", "9" * 5000],
    ["-o", "o.mp4", "--frames", "0-" + "9" * 5000],
]


@pytest.mark.parametrize("words", TOO_LONG)
def test_what_is_too_long_is_told(tmp_path: Path, fluidwarp: Run, words: list[str]):
    write_picture(tmp_path / "cat.png", Picture(np.zeros((48, 64, 3), np.uint8)))
    (tmp_path / "a.toml").write_text("duration = 0.02\n[fluid]\ngrid = 16\n")
    ran = fluidwarp(tmp_path, "render", "a.toml", "-i", "cat.png", *words)
    assert ran.returncode == 1
    assert "a bug in fluidwarp" not in ran.stderr
    assert words[-1][:50] in ran.stderr


def circular_tiff() -> bytes:
    """A TIFF of one page that names itself as the next."""
    packed = io.BytesIO()
    tifffile.imwrite(packed, np.zeros((16, 16, 3), np.uint8), metadata=None)
    data = bytearray(packed.getvalue())
    (start,) = struct.unpack_from("<I", data, 4)
    (entries,) = struct.unpack_from("<H", data, start)
    struct.pack_into("<I", data, start + 2 + 12 * entries, start)
    return bytes(data)


ENDLESS = {"comments.ppm": lambda: b"P6 " + b"# " * 60 + b"x", "circle.tif": circular_tiff}


@pytest.mark.parametrize("name", ENDLESS)
def test_a_small_picture_does_not_take_for_ever(tmp_path: Path, name: str):
    """A comment that can be taken for many, and pages in a circle: both had no end, nor heeded Ctrl+C."""
    (tmp_path / name).write_bytes(ENDLESS[name]())
    ran = subprocess.run(
        [sys.executable, "-c", READING, str(tmp_path / name)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout == {"comments.ppm": "damaged\n", "circle.tif": "1 page\n"}[name]


READING = """
import sys
from pathlib import Path
from app.errors import UserError
from app.media.source import open_source
try:
    source = open_source(Path(sys.argv[1]))
    print("1 page" if source.clip is None and not source.picture.note else "several pages")
except UserError as error:
    print("damaged" if "is truncated or damaged" in str(error) else error)
"""


def many_channels(path: Path) -> None:
    if path.suffix == ".exr":
        plane = np.zeros((40, 30), np.float16)
        parts = [OpenEXR.Part({"name": f"{part}"}, {f"{part}.{name}": plane for name in "RGBA"}) for part in range(6)]
        OpenEXR.File(parts).write(str(path))
    else:
        tifffile.imwrite(path, np.zeros((40, 30, 24), np.uint8), photometric="rgb", metadata=None)


@pytest.mark.parametrize("ending", [".exr", ".tif"])
def test_the_limit_of_pixels_is_one_of_their_values_too(tmp_path: Path, ending: str):
    """What is empty packs to a thousandth, however many channels it has."""
    path = tmp_path / f"a{ending}"
    many_channels(path)
    with pytest.raises(UserError, match=r"30 x 40 pixels of 24 channels are more.*--max-pixels 7200\."):
        read_picture(path, 7199)
    assert read_picture(path, 7200).width == 30


def test_a_still_takes_no_more_of_an_animation_than_its_first_frame(tmp_path: Path):
    """Frames after the first may be many and damaged."""
    frames = [Image.fromarray(np.full((64, 64), 40 * number, np.uint8)) for number in range(5)]
    frames[0].save(tmp_path / "a.gif", save_all=True, append_images=frames[1:])
    data = (tmp_path / "a.gif").read_bytes()
    (tmp_path / "a.gif").write_bytes(data[: len(data) - 60])
    assert open_source(tmp_path / "a.gif", animated=False).picture.width == 64
    with pytest.raises(UserError, match="truncated or damaged"):
        open_source(tmp_path / "a.gif")


def test_a_later_frame_of_a_gif_has_the_limit_of_pixels_too(tmp_path: Path) -> None:
    """Of some 2 gigapixels, said by a file of some hundred bytes: it would be refused after 90 s and 8 GB."""
    frames = [Image.fromarray(np.full((20, 24), value, np.uint8)) for value in (0, 255)]
    frames[0].save(tmp_path / "a.gif", save_all=True, append_images=frames[1:])
    data = bytearray((tmp_path / "a.gif").read_bytes())
    frame = data.rindex(b"\x2c\x00\x00\x00\x00")  # its descriptor: left, top, width, height
    data[frame + 5 : frame + 9] = b"\xff\xff\xff\x7f"
    (tmp_path / "a.gif").write_bytes(data)
    with pytest.raises(UserError, match="a frame of it has more than the limit of"):
        open_source(tmp_path / "a.gif")


def test_what_does_not_fit_into_the_memory_has_a_mend(tmp_path: Path):
    mend = "it does not fit into the memory; close other programs, or make it smaller first"
    with pytest.raises(UserError, match=mend), decoding(tmp_path / "a.png", "PNG"):
        raise MemoryError


@pytest.mark.parametrize("error", [KeyError(), KeyError(7), IndexError("12")])
def test_no_reason_is_told_of_a_decoder_that_gives_none(tmp_path: Path, error: Exception):
    """It was told as "(KeyError)"."""
    with (
        pytest.raises(UserError, match="file is truncated or damaged; get it again"),
        decoding(tmp_path / "a.png", "PNG"),
    ):
        raise error
