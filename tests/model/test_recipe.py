"""The recipe: written and read without loss, and every fault told in one sentence."""

from __future__ import annotations

import math
import re
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from app.errors import UserError
from app.media.opening import shipped_recipes
from app.media.recipes import read_recipe
from app.model import areas, forces, masks, strokes, toml
from app.model import recipe as recipes
from app.model.edits import cut_off, with_change, with_taken
from app.model.recipe import DensitySettings, FluidSettings, Output, Playback, Recipe
from app.model.schema import written
from app.model.strokes import Change, Dab, Sample, Stroke

ROOT = Path(__file__).parents[2]

FULL = """
version = 1
name = "Everything"
picture = "cat.jpg"
duration = 2.5
edges = "mirror"
mode = "density"

[fluid]
solver = "paper"
grid = 96
dt = 0.025
viscosity = 0.01
drag = 0.5
walls = "no-slip"

[density]
kappa = 0.001
source = [0.1, 0, 0]

[stop]
det_below = 0.1
[[stop.watch]]
point = [0.5, 0.25]
distance = 0.1

[time]
speed = 0.5
ping_pong = true

[output]
size = 640
fps = 25

[[viscosity]]
kind = "picture"
picture = "source"
range = [0.001, 10]
levels = 4
window = { box = [0.1, 0.1, 0.9, 0.9], shape = "ellipse", soft = 0.05 }

[[freeze]]
name = "border"
kind = "constant"
window = { box = [0.05, 0.05, 0.95, 0.95], invert = true }

[[freeze]]
kind = "path"
points = [[0.1, 0.1], [0.2, 0.2]]

[[force]]
name = "hat"
kind = "gradient"
segment = { above = 0.5, window = { box = [0, 0, 1, 0.5] } }
swell = true
keys = [[0, 0], [1, 0.5]]
interpolation = "smooth"

[[force]]
kind = "curve"
points = [[0.1, 0.1], [0.5, 0.2], [0.9, 0.1]]
direction = "normal"
formula = "sin(2 * pi * t)"

[[force]]
kind = "sink"
point = [0.5, 0.5]
at = [0, 0.5]

[[change]]
tick = 10
viscosity = 0.1
reset_warp = true

[[stroke]]
tool = "push"
radius = 0.1
samples = [[0, 0.1, 0.30000000000000004, 1], [4, 0.2, 0.3, 0.5]]
"""


def test_round_trip_loses_nothing():
    recipe = Recipe.parse(FULL)
    assert Recipe.parse(recipe.text()) == recipe
    assert Recipe.parse(recipe.text()).agrees_until(recipe) == float("inf")
    assert recipe.stroke[0].samples[0][2] == 0.30000000000000004


def test_defaults_are_not_written():
    assert Recipe().text() == "version = 5\n"
    assert Recipe.parse("") == Recipe()


def test_what_older_versions_said_is_said_in_this_one():
    old = Recipe.parse('version = 1\npicture = "a.png"\n[[stroke]]\ntool = "push"\nsamples = [[0, 0.1, 0.2, 1.0]]\n')
    assert old.stroke[0].detail == 0
    assert old.text().startswith("version = 5\n")
    for version in (1, 2, 3, 4):
        assert Recipe.parse(old.text().replace("version = 5", f"version = {version}")) == old
    fine = old.edited(stroke=(old.stroke[0].model_copy(update={"detail": 1400}),))
    assert Recipe.parse(fine.text()) == fine
    assert fine.agrees_until(old) == 0


def test_save_and_load(tmp_path: Path):
    recipe = Recipe.parse(FULL)
    (tmp_path / "a.toml").write_text(recipe.text(), "utf-8")
    assert read_recipe(tmp_path / "a.toml") == recipe
    assert [path.name for path in tmp_path.iterdir()] == ["a.toml"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("durration = 1", "line 1: unknown key 'durration'; did you mean 'duration'?"),
        ("\n[fluid]\ngird = 3", "line 3: unknown key 'fluid.gird'; did you mean 'grid'?"),
        ("duration = 0", "line 1: 'duration' must be greater than 0, not 0"),
        ("duration = nan", "'duration' must be a finite number, not nan"),
        ("[fluid]\nviscosity = inf", "line 2: 'fluid.viscosity' must be a finite number, not inf"),
        ("duration = '1'", "'duration' must be a number, not \"1\""),
        ("[fluid]\ngrid = 1.5", "'fluid.grid' must be a whole number, not 1.5"),
        ("[fluid]\nwalls = true", "'fluid.walls' must be one of 'free-slip' or 'no-slip', not true"),
        ("fluid = 3", "'fluid' must be a table, not 3"),
        ("stroke = 3", "'stroke' must be a list, not 3"),
        ("[force]\nkind = 'vortex'", "line 1: 'force' must be a list, not a table; begin each with [[force]]"),
        ("version = 0", "'version' must be 5, not 0"),
        ("version = true", "'version' must be 5, not true"),
        ("version = 1.0", "'version' must be 5, not 1.0"),
        (
            "[[force]]\nkind = 'vortex'\npoint = [0.1, 0.1]\nat = true",
            "line 4: force[1]: 'at' must be a number or a list of numbers, not true",
        ),
        ("[[force]]\nkind = 'vortex'\npoint = [0.1, 0.1]\nat = [1, true]", "'at[2]' must be a number, not true"),
        ("[[handle]]\nto = [0.1, 0.1]\npoints = 3", "line 3: handle[1]: 'points' must be a list, not 3"),
        ("[[handle]]\nto = [0.1, 0.1]\npoints = [[0.1, 0.1], 'x']", "'points[2]' must be a list, not \"x\""),
        ("[[handle]]\nto = [0.1, 0.1]\npoints = [[0.1, 0.1], [0.2]]", "'points[2][2]' is missing"),
        ("[[handle]]\nat = [0.1, 0.1]\ngoals = [[0.1, true], [0.2, 0.2]]", "'goals[1][2]' must be a number, not true"),
        ("[[handle]]\nat = [{}, 0.1]\nto = [0.1, 0.1]", "handle[1]: 'at[1]' must be a number, not a table"),
        (
            "[[handle]]\nname = 'a'\nat = [0.1, 0.1]\nkeys = [[0, 1, {}]]",
            "handle[1] \"a\": 'keys[1][3]' must be a number",
        ),
        ("[[pin]]\nname = [3]\nat = [0.1, 0.1]", "line 2: pin[1]: 'name' must be a text in quotes, not a list of 1"),
        ("[[pin]]\npoints = true", "line 2: pin[1]: 'points' must be a list, not true"),
        ("duration = 2020-01-01", "'duration' must be a number, not 2020-01-01"),
        ("version = 6", "of version 6, and this fluidwarp reads recipes up to version 5"),
        ("duration = 1\nduration = 2", "the same key is given twice"),
        ("duration = ", "not valid TOML"),
        ("duration = 1e6", "make dt larger"),
        ("[time]\nstart = 2\nend = 1", "'end' (1) is before 'start' (2)"),
        ("[time]\ndissolve = 1\nping_pong = true", "'dissolve' and 'ping_pong' do not go together; leave one out"),
        ("[time]\ndissolve = 1\nhold_last = 0.5", "'dissolve' and 'hold_last' do not go together; leave one out"),
        ("[[stop.watch]]\npoint = [0.1, 0.1]", "stop.watch[1]: give either 'distance' or 'place'"),
        ("[[stroke]]\ntool = 'push'\nsamples = []", "line 3: stroke[1]: 'samples' must be a list of at least 1"),
        ("[[stroke]]\ntool = 'pish'\nsamples = [[0, 0, 0, 1]]", "'tool' must be one of 'push'"),
        ("[[force]]\nkind = 'whirl'", ', not "whirl"'),
        (f"[[force]]\nkind = '{'a' * 999}'", f', not "{"a" * 36}...'),
        ("[[stroke]]\ntool = 'push'\nradius = 0\nsamples = [[0, 0, 0, 1]]", "'radius' must be at least 1e-06, not 0"),
        (
            "[[stroke]]\ntool = 'push'\nradius = 1e-7\nsamples = [[0, 0, 0, 1]]",
            "'radius' must be at least 1e-06, not 1e-07",
        ),
        (
            "[[stroke]]\ntool = 'push'\ndetail = 65537\nsamples = [[0, 0, 0, 1]]",
            "'detail' must be at most 65536, not 65537",
        ),
        ("[[stroke]]\ntool = 'push'\nsamples = [[1, 0, 0, 1], [0, 0, 0, 1]]", "must not go backwards"),
        ("[[stroke]]\ntool = 'push'\nsamples = [[0, 0, nan, 1]]", "'samples[1][3]' must be a finite number"),
        ("[density]\nsource = [1, 1]", "'source' must be three numbers (red, green, blue), not 2"),
        ("[density]\nsource = [1, 1, 1, 1]", "'source' must be three numbers (red, green, blue), not 4"),
    ],
)
def test_faults_are_told_in_a_sentence(text: str, words: str):
    with pytest.raises(UserError) as caught:
        Recipe.parse(text, "a.toml")
    message = str(caught.value)
    assert message.startswith("a.toml")
    assert words in message
    assert len(message.splitlines()) == 1
    assert "pydantic" not in message
    assert "input" not in message.lower()


FORCE = "[[force]]\nkind = 'vortex'\npoint = [0.5, 0.5]\n"
STROKE = "[[stroke]]\ntool = 'push'\nsamples = [[0, 0, 0, 1]]\n"
HANDLE = "[[handle]]\nat = [0.5, 0.5]\nto = [0.6, 0.5]\n"
LAYER = "[[viscosity]]\nkind = 'constant'\n"
PICTURE = "[[freeze]]\nkind = 'picture'\n"


@pytest.mark.parametrize(
    ("text", "most"),
    [
        ("fluid.dt = 10\nduration = {}", 1_000_000),
        ("[fluid]\ngrid = {}", 4096),
        ("[fluid]\ndt = {}", 10),
        ("[fluid]\nviscosity = {}", 1000),
        ("[fluid]\ndrag = {}", 1000),
        ("[fluid]\nsweeps = {}", 10_000),
        ("[density]\nkappa = {}", 1000),
        ("[density]\nsource = [0, 0, {}]", 1000),
        ("[stop]\nhandles_within = {}\n" + HANDLE, 1),
        ("[[stop.watch]]\npoint = [0.5, 0.5]\ndistance = {}", 10),
        ("[time]\nspeed = {}", 1000),
        ("[time]\nhold_first = {}", 100_000),
        ("[output]\nsize = {}", 32_768),
        ("[output]\nfps = {}", 1000),
        ("[output]\nquality = {}", 100),
        (FORCE + "strength = {}", 1e6),
        (FORCE + "radius = {}", 10),
        (FORCE + "at = {}", 1_000_000),
        ("[[force]]\nkind = 'vortex'\npoint = [0.5, {}]", 10),
        ("[[force]]\nkind = 'point'\ndirection = [1, 0]\npoint = [0.5, 0.5]\nlocal = {}", 1),
        (LAYER + "scale = {}", 1e6),
        (PICTURE + "threshold = {}", 1),
        (PICTURE + "blur = {}", 10),
        (PICTURE + "levels = {}", 256),
        (PICTURE + "segment = {{ above = {} }}", 1),
        (PICTURE + "segment = {{ color = '#000000', tolerance = {} }}", 2),
        (LAYER + "scale = 1\nwindow = {{ box = [0, 0, 1, 1], soft = {} }}", 10),
        (HANDLE + "radius = {}", 1),
        (HANDLE + "stiffness = {}", 1),
        (HANDLE + "start = {}", 1_000_000),
        (STROKE + "radius = {}", 10),
        (STROKE + "hardness = {}", 1),
        (STROKE + "strength = {}", 100),
        ("[[stroke]]\ntool = 'push'\nsamples = [[{}, 0, 0, 1]]", 10_000_000),
        ("[[stroke]]\ntool = 'push'\nsamples = [[0, 0, {}, 1]]", 10),
        ("[[stroke]]\ntool = 'push'\nsamples = [[0, 0, 0, {}]]", 1),
        ("[[change]]\ntick = 0\nviscosity = {}", 1000),
        ("[[change]]\ntick = 0\ndrag = {}", 1000),
    ],
)
def test_numbers_have_an_upper_bound_which_is_allowed(text: str, most: float):
    Recipe.parse(text.format(most))
    above = most + 1 if isinstance(most, int) else 1.0001 * most
    with pytest.raises(UserError) as caught:
        Recipe.parse(text.format(above))
    told = re.search(r"must be at most (\S+), not", str(caught.value))
    assert told is not None
    assert float(told[1]) == most


@pytest.mark.parametrize(
    "text",
    [
        "[time]\nstart = 1\nend = 1",
        HANDLE + "start = 1\nend = 1",
        HANDLE + "duration = 1\nkeys = [[1, 0, 0], [1, 0.5, 0.5]]",
        2 * "[[change]]\ntick = 3\nviscosity = 1\n",
        2 * "[[mask]]\nkind = 'invert'\nof = 'frozen'\ntick = 3\n",
        STROKE + "repeat = 2\nevery = 9999999",
        "[[stroke]]\ntool = 'curve'\nsamples = [[3, 0, 0, 1], [3, 1, 1, 1]]",
        64 * HANDLE,
    ],
)
def test_what_must_not_go_beyond_another_may_be_the_same(text: str):
    Recipe.parse(text)


CURVES = 2 * "[[force]]\nkind = 'curve'\npoints = [[0.1, 0.1], [0.6, 0.1], [0.6, 0.9]]\nradius = 0.02\n"
PIECES = 3 + 8 * 1.3 / 0.02  # of one of them
LINES = (
    2 * "[[handle]]\npoints = [[0.1, 0.1], [0.2, 0.1]]\nkeys = []\n" + "[[pin]]\npoints = [[0.1, 0.5], [0.2, 0.5]]\n"
)
OUTLINE = "outline = [[0, 0], [1, 0], [1, 1], [0.5, 0.7], [0, 1]]\n"


@pytest.mark.parametrize(
    ("module", "limit", "text", "count", "words"),
    [
        (areas, "MOST_CORNERS", f"[[mask]]\nkind = 'fill'\nof = 'frozen'\ntick = 0\namount = 1\n{OUTLINE}", 5,
         "its outline has 5 corners; at most 4 work"),
        (masks, "MOST_POINTS", "[[freeze]]\nkind = 'path'\npoints = [[0, 0], [1, 0], [1, 1]]", 3,
         "its path has 3 points; at most 2 work"),
        (forces, "MOST_FORCES", CURVES, 2, "there are 2 forces; at most 1 work"),
        (forces, "MOST_PIECES", CURVES, PIECES, "'radius' (0.02) is too small for so long a curve"),
        (forces, "MOST_PIECES_IN_ALL", CURVES, 2 * PIECES, "the curves of the forces are cut into 1046 pieces"),
        (forces, "MOST_COVERED", CURVES, 2 * PIECES * 0.04**2, "cover the whole picture 2 times; at most"),
        (strokes, "MOST_AT_ONCE", 3 * (STROKE + "\n"), 3, "3 strokes act at once in tick 0"),
        (recipes, "MOST_TICKS", "duration = 10\nfluid = { dt = 0.01 }", 1000,
         "'duration' / 'fluid.dt' is more than 999 ticks"),
        (recipes, "MOST_HANDLES", LINES, 3, "there are 3 handles and pins; at most 2 work"),
        (recipes, "MOST_LINES", LINES, 3, "there are 3 lines that are led or held; at most 2 work"),
    ],
)  # fmt: skip
def test_of_what_is_counted_there_may_be_as_much_as_the_limit(
    module: Any, limit: str, text: str, count: float, words: str, monkeypatch: pytest.MonkeyPatch
):
    """And no more: it is refused in a sentence when it is read."""
    monkeypatch.setattr(module, limit, count)
    Recipe.parse(text)
    monkeypatch.setattr(module, limit, count - 1 if isinstance(count, int) else 0.999 * count)
    with pytest.raises(UserError, match=re.escape(words)):
        Recipe.parse(text)


@pytest.mark.parametrize(
    ("table", "kinds"),
    [
        ("force", ("point", "curve", "field", "gradient", "vortex", "source", "sink")),
        ("viscosity", ("constant", "picture", "path")),
        ("freeze", ("constant", "picture", "path")),
        ("mask", ("stroke", "clear", "fill", "invert", "feather", "grow", "shrink", "picture")),
    ],
)
def test_of_a_kind_that_there_is_not_all_are_told_that_there_are(table: str, kinds: tuple[str, ...]):
    all_of_them = f"a.toml, line 1: {table}[1]: 'kind' must be one of {', '.join(map(repr, kinds))}"
    for text, more in (("kind = 'whirl'", ', not "whirl"'), ("", "")):
        with pytest.raises(UserError) as caught:
            Recipe.parse(f"[[{table}]]\n{text}", "a.toml")
        assert str(caught.value) == all_of_them + more


def test_of_several_faults_one_is_told_and_how_many_more_there_are():
    """A key that is not known comes first, as another may lack for it."""
    faults = ("duration = 0", "edges = 3", "picutre = 'a.png'")
    first = "a.toml, line 1: 'duration' must be greater than 0, not 0"
    known = "unknown key 'picutre'; did you mean 'picture'?"
    wanted = (first, f"{first} (1 more after this one)", f"a.toml, line 3: {known} (2 more after this one)")
    for count, said in enumerate(wanted, 1):
        with pytest.raises(UserError) as caught:
            Recipe.parse("\n".join(faults[:count]), "a.toml")
        assert str(caught.value) == said


@pytest.mark.parametrize(
    ("key", "part"),
    [
        ("stroke", {"tool": "push", "samples": ((0, 0.1, 0.1, 1.0),)}),
        ("change", {"tick": 3, "drag": 1.0}),
        ("force", {"kind": "vortex", "point": (0.5, 0.5)}),
        ("handle", {"at": (0.5, 0.5), "to": (0.6, 0.5)}),
        ("mask", {"kind": "invert", "tick": 3, "of": "frozen"}),
    ],
)
def test_a_recording_is_as_long_as_its_recipe_once_anything_is_done_in_it(key: str, part: dict[str, object]):
    """What is painted on masks before the first tick takes no time, and a pin does nothing by itself."""
    assert Recipe.model_validate({"duration": 2.0, key: (part,)}).recorded == 120
    still = {"mask": ({"kind": "invert", "tick": 0, "of": "frozen"},), "pin": ({"at": (0.5, 0.5)},)}
    assert Recipe.model_validate({"duration": 2.0} | still).recorded == 0


@pytest.mark.parametrize(
    ("key", "part", "begins"),
    [
        ("stroke", {"tool": "push", "samples": ((3, 0.1, 0.1, 1.0),)}, 3),
        ("stroke", {"tool": "push", "samples": ((3, 0.1, 0.1, 1.0),), "muted": True}, 9),
        ("change", {"tick": 3, "drag": 1.0}, 3),
        ("mask", {"kind": "invert", "tick": 3, "of": "frozen"}, 3),
        ("handle", {"at": (0.5, 0.5), "to": (0.6, 0.5), "start": 0.05}, 3),
        ("pin", {"at": (0.5, 0.5), "start": 0.05}, 3),
        ("force", {"kind": "vortex", "point": (0.5, 0.5)}, 0),
        ("freeze", {"kind": "picture"}, 0),
    ],
)
def test_a_recipe_begins_where_the_first_of_its_parts_does(key: str, part: dict[str, object], begins: int):
    """Time before that is passed over. A force may act, and a mask of the picture's is laid, from the first tick on."""
    stroke = {"tool": "push", "samples": ((9, 0.1, 0.1, 1.0),)}
    assert Recipe.model_validate({"stroke": (stroke,)}).begins == 9
    parts = {"stroke": (stroke,), key: (part, stroke) if key == "stroke" else (part,)}
    assert Recipe.model_validate(parts).begins == begins


def test_a_mark_before_the_text_is_read_over(tmp_path: Path):
    """As Windows' Notepad sets it."""
    (tmp_path / "a.toml").write_text("duration = 2.0\n", "utf-8-sig")
    assert read_recipe(tmp_path / "a.toml").duration == 2


@pytest.mark.parametrize("page", ["README.md", "assets/guide/README.md", "assets/guide/motion.md"])
def test_examples_of_the_documentation_are_recipes(page: str):
    text = (Path(__file__).parents[2] / page).read_text("utf-8")
    examples = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    assert examples
    for example in examples:
        assert Recipe.parse(example, page) != Recipe()


def test_the_guide_names_what_holds_where_a_key_is_left_out():
    text = (Path(__file__).parents[2] / "assets/guide/README.md").read_text("utf-8")
    written = Recipe.parse(re.findall(r"```toml\n(version.*?)```", text, re.DOTALL)[-1])
    own = written.edited(
        name="",
        picture=None,
        map=None,
        duration=1.0,
        time=written.time.model_copy(update={"end": None}),
        output=written.output.model_copy(update={"size": None}),
    )
    assert own == Recipe()
    named = re.findall(r"^(\w+) = ", text, re.MULTILINE)
    for model in (FluidSettings, Playback, Output, DensitySettings):
        assert set(model.model_fields) - {"sweeps"} <= set(named)


def test_files_that_are_none(tmp_path: Path):
    (tmp_path / "noise.toml").write_bytes(bytes(range(256)))
    for name, words in (("none.toml", "there is no such file"), ("noise.toml", "not text"), ("", "is a folder")):
        with pytest.raises(UserError, match=words):
            read_recipe(tmp_path / name)


# -- strokes ----------------------------------------------------------------------------------------------------------


SHIPPED = sorted(shipped_recipes().values())


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_fault_is_told_with_its_line_wherever_it_stands(path: Path):
    lines = path.read_text("utf-8").splitlines()
    keys = [number for number, line in enumerate(lines) if re.match(r"\w+ = [^\[{]*$", line)]
    for number in keys:
        key = lines[number].split(" = ")[0]
        if key == "kind":  # of which the table is told
            continue
        broken = [*lines[:number], f"{key} = {{ nonsense = 1 }}", *lines[number + 1 :]]
        with pytest.raises(UserError, match=rf"^a\.toml, line {number + 1}: .*'(\w+\.)*{key}'"):
            Recipe.parse("\n".join(broken), "a.toml")


def push(*samples: tuple[int, float, float, float], **options: object) -> Stroke:
    return Stroke.model_validate({"tool": "push", "samples": samples, **options})


def test_a_stroke_is_passed_piece_by_piece():
    stroke = push((2, 0.0, 0.0, 1.0), (2, 0.1, 0.0, 1.0), (4, 0.3, 0.2, 0.0))
    assert stroke.at(1) == ()
    assert stroke.at(2) == (Dab(0.0, 0.0, 0.1, 0.0, 1.0),)
    assert stroke.at(3) == (Dab(0.1, 0.0, 0.2, 0.1, 0.75),)
    assert stroke.at(4)[0][:4] == pytest.approx((0.2, 0.1, 0.3, 0.2))
    assert stroke.at(5) == ()


@pytest.mark.parametrize(
    ("handle", "fits"),
    [
        ("", True),
        ("muted = true", False),
        ("end = 0.95", False),
        ("end = 1.0", True),
        ("end = 0.95\nmuted = true", False),
        ("keys = []", False),
    ],
)
def test_a_handle_can_be_fitted_that_is_led_and_held_to_the_end(handle: str, fits: bool):
    led = "" if handle.startswith("keys") else "to = [0.6, 0.5]\n"
    text = f"fluid = {{ dt = 0.05 }}\n[[handle]]\nat = [0.4, 0.5]\n{led}{handle}\n"
    assert Recipe.parse(text).can_fit == fits
    others = "[[handle]]\nat = [0.7, 0.5]\nto = [0.6, 0.5]\nmuted = true\n"
    assert Recipe.parse(text + others).can_fit == fits
    assert Recipe.parse(text + others.replace("muted = true", "")).can_fit


def test_what_is_cut_off_at_a_tick_is_what_was_passed_before_it():
    stroke = push((2, 0.0, 0.0, 1.0), (4, 0.2, 0.2, 1.0), (6, 0.3, 0.2, 0.0))
    for tick in (3, 4, 5, 6):
        cut = stroke.before(tick)
        assert cut is not None
        assert cut.last_tick == tick - 1
        assert [cut.at(k) for k in range(tick)] == [stroke.at(k) for k in range(tick)]
    assert stroke.before(2) is None
    assert stroke.before(7) is stroke


def test_of_each_list_what_is_done_before_a_tick_is_left_and_of_a_mask_or_setting_what_is_done_at_it():
    """And all else of a recipe stays, but for how long it is."""
    text = 'name = "a"\nmap = "m.npy"\namount = 0.5\nfluid = { dt = 0.05, grid = 99 }\nstop = { energy_below = 1 }\n'
    text += '[[force]]\nkind = "point"\npoint = [0.5, 0.5]\ndirection = [1, 0]\n'
    text += '[[viscosity]]\nkind = "constant"\nscale = 2\n[[freeze]]\nkind = "constant"\n'
    begins = {"stroke": "", "handle": "", "pin": "", "change": "", "mask": ""}
    for tick in (2, 3, 4):
        begins["stroke"] += f'[[stroke]]\ntool = "push"\nsamples = [[{tick}, 0.1, 0.1, 1], [{tick + 1}, 0.2, 0.1, 1]]\n'
        begins["handle"] += f"[[handle]]\nat = [0.5, 0.5]\nto = [0.5, 0.6]\nstart = {tick * 0.05}\nend = 9\n"
        begins["pin"] += f"[[pin]]\nat = [0.5, 0.5]\nstart = {tick * 0.05}\n"
        begins["change"] += f"[[change]]\ntick = {tick}\ndrag = {tick}\n"
        begins["mask"] += f'[[mask]]\nkind = "clear"\nof = "frozen"\ntick = {tick}\n'
    whole = Recipe.parse(text + "".join(begins.values()))
    cut = cut_off(whole, 3)
    assert {key: len(getattr(cut, key)) for key in begins} == dict.fromkeys(begins, 1) | {"mask": 2, "change": 2}
    assert (cut.change, cut.mask, cut.pin) == (whole.change[:2], whole.mask[:2], whole.pin[:1])
    assert cut.duration == pytest.approx(0.15)
    others = {key for key in Recipe.model_fields if key not in begins} - {"duration"}
    assert {key for key in others if getattr(cut, key) != getattr(whole, key)} == set()


@pytest.mark.parametrize("setting", [{"viscosity": 0.5}, {"drag": 0.5}, {"walls": "no-slip"}])
@pytest.mark.parametrize("done", ["clear_velocity", "reset_warp", "clear_masks"])
def test_of_a_change_at_the_tick_where_one_goes_on_the_settings_stay_and_what_it_does_goes(
    setting: dict[str, Any], done: str
) -> None:
    """The fluid is shown as it is set there, and the picture as it was before it was reset."""
    set_only, done_only = (Change.model_validate({"tick": 4} | what) for what in (setting, {done: True}))
    whole = Recipe(duration=9.0, change=(set_only.model_copy(update={done: True}),))
    assert cut_off(whole, 5).change == whole.change
    assert cut_off(whole, 4).change == (set_only,)
    assert cut_off(whole, 4).fluid_at(4) == whole.fluid_at(4)
    assert cut_off(whole, 3).change == ()
    assert cut_off(Recipe(duration=9.0, change=(done_only,)), 4).change == ()


@pytest.mark.parametrize(
    "text",
    [
        "picture = {}",
        "map = {}",
        "[[freeze]]\nkind = 'picture'\npicture = {}",
        "[[viscosity]]\nkind = 'picture'\nscale = 1\npicture = {}",
        "[[freeze]]\nkind = 'picture'\nsegment = {{ mask = {} }}",
        "[[force]]\nkind = 'field'\npicture = {}",
        "[[force]]\nkind = 'gradient'\npicture = {}",
        "[[mask]]\nkind = 'picture'\nof = 'frozen'\ntick = 0\npicture = {}",
    ],
)
def test_no_picture_is_called_nothing_or_has_a_nul_in_its_name(text: str):
    Recipe.parse(text.format("'a.png'"))
    with pytest.raises(UserError, match="no file has a NUL in its name"):
        Recipe.parse(text.format('"a\\u0000.png"'))
    with pytest.raises(UserError, match="must "):
        Recipe.parse(text.format("''"))


@pytest.mark.parametrize(("tick", "ticks"), [(0, 1), (1, 1), (2, 2), (7, 7)])
def test_what_is_cut_off_lasts_up_to_there_or_one_tick(tick: int, ticks: int):
    cut = cut_off(Recipe(stroke=(push((0, 0, 0, 1), (9, 1, 0, 1)),), duration=1.0), tick)
    assert (cut.duration, cut.ticks) == (ticks * cut.fluid.dt, ticks)
    assert [stroke.last_tick for stroke in cut.stroke] == ([ticks - 1] if tick else [])


def test_what_is_set_at_a_tick_of_several_changes_leaves_what_the_others_set_there() -> None:
    """A recipe that is written by hand may have a change for each thing that is set; the last of them was kept."""
    several = "change = [{tick = 1, drag = 2}, {tick = 3, viscosity = 0, clear_masks = true}, {tick = 3, drag = 4}]"
    recipe = with_change(Recipe.parse(f"duration = 1.0\n{several}"), 3, {"walls": "no-slip"}, lasts=True)
    wanted = Change(tick=3, viscosity=0, drag=4, walls="no-slip", clear_masks=True)
    assert recipe.change == (Change(tick=1, drag=2), wanted)
    assert with_change(recipe, 3, {"drag": 0.0}, lasts=True).change[-1] == wanted.model_copy(update={"drag": 0.0})


def test_what_is_set_at_the_very_start_is_what_is_gone_on_with_there():
    """Where nothing else is left nothing has been done: the recording has no tick yet."""
    setting = {"viscosity": 0.5, "drag": 0.25, "walls": "no-slip"}
    at_start = {"tick": 0, "viscosity": 0.1, "reset_warp": True}, {"tick": 0} | setting, {"tick": 1, "drag": 9.0}
    whole = Recipe.model_validate({"change": at_start, "duration": 9.0})
    cut = cut_off(whole, 0)
    assert (cut.change, cut.recorded) == ((), 0)
    assert cut.fluid == cut.fluid_at(0) == whole.fluid_at(0) == whole.fluid.model_copy(update=setting)


def test_what_a_reset_lets_go_of_is_held_again_where_the_reset_is_cut_off():
    """Who went back before the reset and painted lost the handles when the time of the reset had come."""
    text = "duration = 2.0\nhandle = [{at = [0.4, 0.5], keys = [[0.1, 0.5, 0.5]]}]\n"
    recipe = Recipe.parse(f"{text}pin = [{{at = [0.8, 0.8]}}, {{at = [0.2, 0.2], end = 0.5}}]")
    held = recipe.handle[0].end, *(pin.end for pin in recipe.pin)
    reset = with_change(recipe, tick := 96, {"reset_warp": True}, lasts=False)
    assert all(led.end == tick * recipe.fluid.dt for led in (*reset.handle, *reset.pin[:1]))
    for until, ends in ((60, held), (97, (1.6, 1.6, 0.5))):
        cut = cut_off(reset, until)
        assert (cut.handle[0].end, *(pin.end for pin in cut.pin)) == pytest.approx(ends)


def test_of_two_pins_on_one_spot_one_is_led_and_the_other_stays():
    recipe = Recipe.parse("pin = [{at = [0.4, 0.5]}, {at = [0.4, 0.5]}]")
    taken, number = with_taken(recipe, recipe.pin[1], 5)
    assert taken.pin == recipe.pin[:1]
    assert taken.handle[number].at == (0.4, 0.5)


def test_what_is_left_of_a_recipe_whose_handles_are_cut_off_waits_for_none_and_can_be_read_again():
    handle = "[[handle]]\nat = [0.4, 0.5]\nto = [0.5, 0.5]\nstart = 0.5\n"
    recipe = Recipe.parse(f"duration = 2.0\n[fluid]\ndt = 0.1\n[stop]\nhandles_within = 0.001\n{handle}")
    assert cut_off(recipe, 10).stop.handles_within == 0.001
    cut = cut_off(recipe, 2)
    assert cut.handle == ()
    assert Recipe.parse(cut.text()) == cut


def test_sampling_more_often_is_the_same_path():
    coarse = push((0, 0.0, 0.0, 1.0), (4, 0.4, 0.8, 1.0))
    fine = push(*((i, 0.1 * i, 0.2 * i, 1.0) for i in range(5)))
    for tick in range(6):
        for a, b in zip(coarse.at(tick), fine.at(tick), strict=True):
            assert a == pytest.approx(b)


def test_a_curve_acts_at_once_when_it_is_released():
    curve = push((0, 0.0, 0.0, 1.0), (3, 0.5, 0.0, 1.0), (6, 1.0, 0.0, 1.0), tool="curve")
    assert [len(curve.at(tick)) for tick in range(8)] == [0, 0, 0, 0, 0, 0, 2, 0]
    with pytest.raises(ValidationError, match="a curve needs at least two samples"):
        push((0, 0.5, 0.5, 1.0), tool="curve")


def test_recipes_agree_until_they_differ():
    first, second = push((0, 0, 0, 1), (5, 1, 0, 1)), push((10, 0, 0, 1), (20, 1, 0, 1), (20, 1, 1, 1), (30, 1, 0, 1))
    recipe = Recipe(stroke=(first, second))
    cut = second.model_copy(update={"samples": second.samples[:2]})
    shorter = second.model_copy(update={"samples": second.samples[:3]})
    assert recipe.agrees_until(Recipe(stroke=(first, second))) == float("inf")
    assert recipe.agrees_until(Recipe(stroke=(first,))) == 10
    assert recipe.agrees_until(Recipe(stroke=(first, cut))) == 20
    assert recipe.agrees_until(Recipe(stroke=(first, shorter))) == 21
    assert recipe.agrees_until(Recipe(stroke=(first, push((10, 0.5, 0, 1))))) == 10
    assert recipe.agrees_until(Recipe(stroke=(second,))) == 0
    assert recipe.agrees_until(recipe.edited(change=(Change(tick=7, drag=1.0),))) == 7
    assert recipe.agrees_until(recipe.edited(duration=9.0, name="other")) == float("inf")
    assert recipe.agrees_until(Recipe.parse("[fluid]\ngrid = 64").edited(stroke=recipe.stroke)) == 0


@pytest.mark.parametrize(
    ("keys", "agreed"),
    [
        ({"during": (0.51, 2.01)}, 60),  # it ends later, after 1.01 s
        ({"during": (0.51, 0.81)}, 48),  # or earlier
        ({"during": (0.26, 1.01)}, 15),
        ({"during": (0.76, 1.01)}, 30),
        ({"during": (0.51, 2.01), "strength": 2.0}, 30),
        ({"strength": 2.0}, 30),
        ({"muted": True}, 30),
        ({"muted": True, "during": (0.26, 1.01)}, 30),
        ({"during": None, "at": (0.26,)}, 15),
        ({"during": None}, 0),
    ],
    ids=str,
)
def test_recipes_agree_until_a_force_differs(keys: dict[str, Any], agreed: int):
    """Whichever of the two is asked; of one whose end alone is another, until the earlier of both."""
    vortex = {"kind": "vortex", "point": (0.5, 0.5), "during": (0.51, 1.01)}
    later = vortex | {"during": (5.0, 6.0)}
    one, other = (Recipe.model_validate({"force": (force, later)}) for force in (vortex, vortex | keys))
    assert one.agrees_until(other) == other.agrees_until(one) == agreed
    mute = {"muted": True}
    one, other = (Recipe.model_validate({"force": (force | mute, later)}) for force in (vortex, vortex | keys))
    assert one.agrees_until(other) == math.inf


@pytest.mark.parametrize("key", ["stroke", "force", "handle"])
def test_recipes_of_which_one_has_an_equal_part_more_are_not_the_same(key: str):
    one, other = {
        "stroke": (push((10, 0.1, 0.2, 1)), push((20, 0.5, 0.2, 1))),
        "force": Recipe.parse(
            "[[force]]\nkind = 'vortex'\npoint = [0.1, 0.1]\n[[force]]\nkind = 'vortex'\npoint = [0.5, 0.1]\n"
        ).force,
        "handle": Recipe.parse(
            "[[handle]]\nat = [0.1, 0.1]\nto = [0.2, 0.1]\n[[handle]]\nat = [0.5, 0.1]\nto = [0.6, 0.1]\n"
        ).handle,
    }[key]
    lists = [parts for count in range(4) for parts in product((one, other), repeat=count)]
    for mine, theirs in product(lists, lists):
        agreed = Recipe().edited(**{key: mine}).agrees_until(Recipe().edited(**{key: theirs}))
        assert (agreed == math.inf) == (mine == theirs), (mine, theirs)


@pytest.mark.parametrize("other", [(19, 0.5, 0.4, 0.7), (20, 0.6, 0.4, 0.7), (20, 0.5, 0.3, 0.7), (20, 0.5, 0.4, 0.8)])
def test_strokes_part_after_the_last_sample_that_is_the_same_in_all(other: Sample):
    """In its tick, its place and its pressure."""
    first, last = (10, 0.1, 0.2, 0.7), (30, 0.9, 0.4, 0.7)
    one, two = push(first, (20, 0.5, 0.4, 0.7), last), push(first, other, last)
    assert one.agrees_until(two) == two.agrees_until(one) == 11


@pytest.mark.parametrize(
    "keys",
    [
        {"tool": "twirl"}, {"radius": 0.2}, {"hardness": 0.1}, {"strength": 0.5}, {"reverse": True}, {"detail": 1},
        {"symmetry": "left-right"}, {"symmetry": "radial"}, {"sectors": 5}, {"hold": 0.3}, {"local": 0.3},
        {"muted": True},
    ],
    ids=str,
)  # fmt: skip
def test_strokes_of_which_a_brush_differs_in_anything_part_at_their_first_tick(keys: dict[str, Any]):
    samples = (10, 0.1, 0.2, 0.7), (20, 0.5, 0.4, 0.7)
    one, two = push(*samples), push(*samples, **keys)
    assert one.agrees_until(two) == two.agrees_until(one) == 10


def test_past_before_the_parting_is_the_same():
    """What `agrees_until` promises: before that tick, every stroke passes the same pieces."""
    whole = push((0, 0, 0, 1), (3, 1, 0, 1), (3, 1, 1, 1), (8, 0, 0, 0))
    for length in range(1, 5):
        part = whole.model_copy(update={"samples": whole.samples[:length]})
        until = int(min(Recipe(stroke=(whole,)).agrees_until(Recipe(stroke=(part,))), 20))
        assert all(whole.at(tick) == part.at(tick) for tick in range(until))


@pytest.mark.parametrize("path", shipped_recipes().values(), ids=shipped_recipes().keys())
def test_shipped_recipes_are_valid(path: Path):
    recipe = read_recipe(path)
    assert recipe.name
    assert recipe.picture
    assert (path.parent / recipe.picture).is_file()


@pytest.mark.parametrize(
    ("symmetry", "wanted"),
    [
        ("none", [(0.75, 0.625, False)]),
        ("left-right", [(0.75, 0.625, False), (0.25, 0.625, True)]),
        ("up-down", [(0.75, 0.625, False), (0.75, 0.375, True)]),
        ("both", [(0.75, 0.625, False), (0.25, 0.625, True), (0.75, 0.375, True), (0.25, 0.375, False)]),
        # A quarter clockwise each, of a picture twice as wide as high.
        ("radial", [(0.75, 0.625, False), (0.4375, 1.0, False), (0.25, 0.375, False), (0.5625, 0.0, False)]),
    ],
)
def test_the_images_of_a_stroke_lie_about_the_picture_s_middle(symmetry: str, wanted: list[tuple[float, float, bool]]):
    stroke = push((0, 0.75, 0.625, 0.5), symmetry=symmetry, sectors=4)
    found = [(dabs[0], mirrored) for dabs, mirrored in stroke.images(stroke.at(0), (1.0, 0.5))]
    assert [mirrored for _, mirrored in found] == [mirrored for *_, mirrored in wanted]
    for (dab, _), (x, y, _) in zip(found, wanted, strict=True):
        assert dab == pytest.approx((x, y, x, y, 0.5))


def check_written(recipe: Recipe, monkeypatch: pytest.MonkeyPatch) -> None:
    words, numbers = written(recipe)
    monkeypatch.setattr(toml, "MOST_WORDS", words)
    monkeypatch.setattr(toml, "MOST_NUMBERS", numbers)
    assert Recipe.parse(recipe.text()) == recipe


@pytest.mark.parametrize("path", sorted(ROOT.glob("assets/*/*.toml")), ids=lambda path: path.stem)
def test_no_recipe_takes_more_words_and_numbers_than_are_counted(path: Path, monkeypatch: pytest.MonkeyPatch):
    check_written(Recipe.parse(path.read_text("utf-8")), monkeypatch)


def test_nor_does_one_with_everything(monkeypatch: pytest.MonkeyPatch):
    check_written(Recipe.parse(FULL), monkeypatch)


@pytest.mark.parametrize("dt", [1 / 60, 1 / 48, 0.01, 0.0333, 0.1])
def test_a_duration_is_the_nearest_number_of_steps(dt: float):
    for ticks in range(1, 400):
        for part, wanted in ((0.0, ticks), (-0.45, ticks), (0.45, ticks)):
            recipe = Recipe(duration=(ticks + part) * dt, fluid=FluidSettings(dt=dt))
            assert recipe.ticks == wanted
    assert Recipe(duration=0.1 * dt, fluid=FluidSettings(dt=dt)).ticks == 1
