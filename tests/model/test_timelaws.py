"""The time laws of a force: exact integrals, whatever the ticks, and formulas that cannot do harm."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pydantic import ValidationError

from app.errors import UserError
from app.model.schema import frozen
from app.model.timelaws import FUNCTIONS, Formula, FormulaError, Timed


def timed(**keys: Any) -> Timed:
    return Timed.model_validate(frozen(keys))


def total(law: Any, dt: float, ticks: int) -> float:
    return sum(law.impulse(n * dt, (n + 1) * dt) for n in range(ticks))


def test_a_force_acts_at_the_beginning_unless_told_otherwise() -> None:
    law = timed().law
    assert [law.impulse(n / 60, (n + 1) / 60) for n in range(3)] == [1, 0, 0]


@pytest.mark.parametrize("dt", [0.1, 1 / 60, 1 / 24, 0.07, 1 / 3])
def test_an_instant_falls_in_exactly_one_tick(dt: float) -> None:
    for k in range(40):
        law = timed(at=k * 0.1).law
        hits = [n for n in range(60) if law.impulse(n * dt, (n + 1) * dt)]
        assert len(hits) <= 1
        assert hits or k * 0.1 >= 60 * dt - 1e-6
    assert timed(at=0.3).law.impulse(0.3, 0.4) == 1, "3 * 0.1 > 0.3 must not bring it a tick forward"
    assert total(timed(at=[0, 0.25, 1.0]).law, dt, math.ceil(1.1 / dt) + 1) == 3


@pytest.mark.parametrize("dt", [0.1, 1 / 60, 0.33])
def test_an_interval_gives_its_length(dt: float) -> None:
    assert total(timed(during=[0.2, 0.95]).law, dt, round(2 / dt)) == pytest.approx(0.75, abs=1e-12)
    assert timed(during=[0, 1]).law.impulse(2, 3) == 0


@pytest.mark.parametrize("dt", [0.1, 1 / 60, 0.25])
@pytest.mark.parametrize(("interpolation", "expected"), [("linear", 1.5), ("smooth", 1.5), ("hold", 1.0)])
def test_keyframes_are_integrated_exactly(interpolation: str, expected: float, dt: float) -> None:
    law = timed(keys=[[0, 0], [0.5, 2], [1.0, 0]], interpolation=interpolation).law
    assert total(law, dt, round(1 / dt)) == pytest.approx(1.0, abs=1e-12)
    law = timed(keys=[[0, 0], [1, 1]], interpolation=interpolation).law
    assert total(law, dt, round(2 / dt)) == pytest.approx(expected, abs=1e-12), "the last value holds"


def test_smooth_keys_start_and_end_at_rest() -> None:
    law = timed(keys=[[0, 0], [1, 1]], interpolation="smooth").law
    assert law.impulse(0, 1e-3) < 1e-8
    assert law.impulse(0.499, 0.501) == pytest.approx(1e-3, rel=1e-3)


def test_the_first_key_holds_before_it() -> None:
    assert timed(keys=[[1, 3], [2, 0]]).law.impulse(0, 1) == pytest.approx(3)


@pytest.mark.parametrize(
    ("text", "integral"),
    [
        ("1", 1),
        ("t", 0.5),
        ("sin(2*pi*t)", 0),
        ("sin(pi*t)**2", 0.5),
        ("exp(-t)", 1 - math.exp(-1)),
        ("1 if t < 0.5 else 0", 0.5),
        ("step(t - 0.5) * 2", 1),
        ("pulse(t, 0.2, 0.7)", 0.5),
        ("max(0, min(1, 2*t, 5))", 0.75),
        ("smoothstep(0, 1, t)", 0.5),
        ("abs(-t) % 1 - +0", 0.5),
        ("(0.2 <= t < 0.7) and not t > 2", 0.5),
        ("-2**2", -4),
    ],
)
def test_formulas(text: str, integral: float) -> None:
    assert total(timed(formula=text).law, 1 / 60, 60) == pytest.approx(integral, abs=2e-3)


def test_a_smooth_formula_is_integrated_exactly() -> None:
    assert Formula("sin(pi*t)").impulse(0, 1) == pytest.approx(2 / math.pi, abs=1e-7)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("foo(t)", 'calls "foo"'),
        ("x + 1", 'names "x"'),
        ("__import__('os')", 'calls "__import__"'),
        ("t.real", "not allowed"),
        ("(1).__class__", "not allowed"),
        ("[1, 2]", "not allowed"),
        ("lambda: 1", "not allowed"),
        ("sin(t", "cannot be read"),
        ("2*sin", "which is a function; write sin"),
        ("", "cannot be read"),
        ("'a' * 3", "not allowed"),
        ("True", "not allowed"),
        ("sin(1, 2)", "2 numbers"),
        ("min(1)", "1 numbers"),
        ("sin(x=1)", "not allowed"),
        ("1; 2", "cannot be read"),
        ("1" + "0" * 400, "too large"),
        ("1+" * 300 + "1", "longer"),
        ("-" * 200 + "1", "nested"),
        ("t\x00", "cannot be read"),
    ],
)
def test_what_a_formula_may_not_hold_is_said_on_reading(text: str, part: str) -> None:
    with pytest.raises(ValidationError, match=part.replace("(", r"\(")):
        timed(formula=text)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("1/t", "divides by zero at t = 0"),
        ("t % 0", "divides by zero"),
        ("log(t - 1)", "no finite value"),
        ("9**9**9", "no finite value"),
        ("sqrt(-1)", "no finite value"),
        ("(-1)**0.5", "no finite value"),
        ("1e308 * 10", "no finite value"),
    ],
)
def test_a_formula_without_a_value_is_found_before_it_runs(text: str, part: str) -> None:
    law = timed(formula=text).law
    with pytest.raises(FormulaError, match=part.replace("(", r"\(")):
        law.check(1.0)


VALUES = {
    "sin(0.2)": math.sin(0.2), "cos(0.2)": math.cos(0.2), "tan(0.2)": math.tan(0.2), "asin(0.2)": math.asin(0.2),
    "acos(0.2)": math.acos(0.2), "atan(0.2)": math.atan(0.2), "sinh(0.2)": math.sinh(0.2), "cosh(0.2)": math.cosh(0.2),
    "tanh(0.2)": math.tanh(0.2), "exp(0.2)": math.exp(0.2), "log(0.2)": math.log(0.2), "sqrt(0.09)": 0.3,
    "floor(-1.5)": -2, "ceil(-1.5)": -1, "atan2(1, -1)": 0.75 * math.pi, "abs(-3)": 3, "min(3, 1, 2)": 1,
    "max(3, 5, 2)": 5, "step(-0.1) + step(0) + step(2)": 2, "pulse(1, 1, 2) + 2*pulse(2, 1, 2) + 4*pulse(0, 1, 2)": 1,
    "smoothstep(1, 3, 1.5)": 0.15625, "smoothstep(1, 3, 4)": 1, "7.5 % 2": 1.5, "2**-1": 0.5, "7 / 2 - 1 * 2 + 3": 4.5,
    "(0 == 1) + 2*(1 == 1) + 4*(1 != 1) + 8*(0 != 1) + 16*(1 == 0)": 10,
}  # fmt: skip


@pytest.mark.parametrize(("text", "value"), VALUES.items())
def test_functions_and_operators_are_what_they_are_called(text: str, value: float) -> None:
    assert Formula(text)(0.0) == pytest.approx(value, rel=1e-15)


def test_every_function_is_among_them() -> None:
    assert all(f"{name}(" in " ".join(VALUES) for name in FUNCTIONS)


def test_feedback_sees_the_state() -> None:
    seen = []
    law = timed(feedback=lambda state: seen.append(state) or 2.0).law
    assert law.impulse(0, 0.5, "state") == 1.0
    assert seen == ["state"]
    for value in (math.nan, math.inf, -math.inf):
        with pytest.raises(UserError, match=f"feedback function returned {value}"):
            timed(feedback=lambda state, value=value: value).law.impulse(0, 1)


@pytest.mark.parametrize(
    ("keys", "part"),
    [
        ({"at": 0, "during": [0, 1]}, "at and during"),
        ({"during": [1, 0.5]}, "ends before it starts"),
        ({"during": [1, 1]}, "ends before it starts"),
        ({"during": [0]}, "during"),
        ({"keys": [[0, 0], [1, 1], [1, 2]]}, "keys overlap"),
        ({"keys": [[1, 0], [0, 1]]}, "keys overlap"),
        ({"keys": []}, "at least 1"),
        ({"keys": [[0, math.nan]]}, "finite"),
        ({"at": []}, "at least 1"),
        ({"at": [0, 0]}, "same instant twice"),
        ({"at": -1}, "greater than or equal to 0"),
        ({"at": math.inf}, "at"),
        ({"at": "now"}, "at"),
        ({"at": True}, "at"),
        ({"formula": 3}, "formula"),
        ({"interpolation": "hold"}, "there are none"),
        ({"keys": [[0, 1]], "interpolation": "wavy"}, "interpolation"),
        ({"feedback": "f"}, "feedback"),
        ({"when": 1}, "when"),
    ],
)
def test_bad_laws_are_refused(keys: dict[str, Any], part: str) -> None:
    with pytest.raises(ValidationError, match=part):
        timed(**keys)


@pytest.mark.parametrize(("at", "wanted"), [(1, (1,)), (1.5, (1.5,)), ([1, 1.5], (1, 1.5))])
def test_one_instant_need_not_be_a_list(at: object, wanted: tuple[float, ...]) -> None:
    assert timed(at=at).at == wanted


@pytest.mark.parametrize(
    ("at", "where"),
    [(True, ("at",)), ("now", ("at",)), ({"x": 1}, ("at",)), ([1, True], ("at", 1)), ([2, "x"], ("at", 1))],
)
def test_what_is_no_instant_is_told_where_it_was_written(at: object, where: tuple[str | int, ...]) -> None:
    with pytest.raises(ValidationError) as told:
        timed(at=at)
    assert told.value.errors()[0]["loc"] == where


@pytest.mark.parametrize("keys", [{"at": 2}, {"at": [1, 2]}, {"during": [1.5, 4]}])
def test_a_law_that_never_acts_is_told(keys: dict[str, Any]) -> None:
    remark = timed(**keys).law.check(1.0)
    assert remark is not None
    assert remark.startswith("never acts: it starts at")
    assert timed(**keys).law.check(3.0) is None


def test_a_law_that_acts_at_the_very_end_never_acts() -> None:
    for keys in ({"at": 2}, {"during": [2, 4]}):
        assert timed(**keys).law.check(2.0) == "never acts: it starts at 2 s, and the simulation ends at 2 s"
        assert timed(**keys).law.check(2.001) is None


def test_a_formula_is_tried_at_256_moments_and_the_end() -> None:
    for moment in (0.5, 1.0, 1 / 256):
        with pytest.raises(FormulaError, match=f"divides by zero at t = {moment:.6g}"):
            timed(formula=f"1 / (t - {moment!r})").law.check(1.0)
    timed(formula="1 / (t - 0.5001)").law.check(1.0)


def test_comparisons_in_a_row_all_hold_and_words_bind_as_in_python() -> None:
    for text, value in (
        ("1 < 2 < 3", 1), ("1 < 3 < 2", 0), ("3 < 4 > 2", 1), ("2 <= 2", 1), ("2 < 2", 0), ("2 >= 3", 0), ("2 >= 2", 1),
        ("2 > 2", 0), ("1 or 1 and 0", 1), ("not 0 and 0", 0), ("2 if 0 else 3", 3), ("2 if 1 else 3", 2), ("-+-2", 2),
        ("e", math.e),
    ):  # fmt: skip
        assert Formula(text)(0.0) == value


def test_a_formula_may_be_500_characters_and_50_deep() -> None:
    timed(formula="-" * 50 + "1")
    with pytest.raises(ValidationError, match="nested too deeply"):
        timed(formula="-" * 51 + "1")
    timed(formula="t" + " " * 499)
    with pytest.raises(ValidationError, match="longer than 500"):
        timed(formula="t" + " " * 500)
