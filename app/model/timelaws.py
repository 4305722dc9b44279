"""When a force acts: at instants, during an interval, along keyframes, by a formula of time, or by feedback.

A law is a number that multiplies a force's field as time passes. What the simulation needs of it is its integral over
a tick, so a recipe means the same thing at every dt (paper, section 4.2).
"""

from __future__ import annotations

import ast
import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import Annotated, Any, Literal, Protocol, Self

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from app.errors import UserError
from app.model.schema import Model, Several

Seconds = Annotated[float, Field(ge=0, le=1_000_000)]
"""Seconds since the simulation began."""


class Law(Protocol):
    """A number that varies in time."""

    def impulse(self, t0: float, t1: float, state: Any = None) -> float:
        """Its integral over [t0, t1) seconds; `state` is what a feedback law looks at."""
        ...

    def check(self, duration: float) -> str | None:
        """What the user should know if it never acts within `duration` seconds; raises ValueError where it fails."""
        ...


@dataclass(frozen=True)
class Instants:
    """A unit impulse at each of `times`: the paper's instantaneous force."""

    times: tuple[float, ...]

    def impulse(self, t0: float, t1: float, state: Any = None) -> float:
        """How many of the instants the tick contains."""
        # 3 * 0.1 is a little more than 0.3: without the slack, a force at 0.3 would act a tick too soon.
        slack = 1e-6 * (t1 - t0)
        return float(sum(t0 - slack <= t < t1 - slack for t in self.times))

    def check(self, duration: float) -> str | None:
        """A remark if all instants come after the end."""
        first = min(self.times)
        return _too_late(first, duration) if first >= duration else None


@dataclass(frozen=True)
class Interval:
    """1 from `start` to `end`, and 0 outside: the paper's constant force."""

    start: float
    end: float

    def impulse(self, t0: float, t1: float, state: Any = None) -> float:
        """The length of the overlap with the tick."""
        return max(0.0, min(t1, self.end) - max(t0, self.start))

    def check(self, duration: float) -> str | None:
        """A remark if the interval starts after the end."""
        return _too_late(self.start, duration) if self.start >= duration else None


@dataclass(frozen=True)
class Keyframes:
    """Values at given times, joined `linear`, `smooth` (at rest in each key) or by `hold`; constant outside them."""

    keys: tuple[tuple[float, float], ...]
    interpolation: Literal["linear", "smooth", "hold"] = "linear"

    def impulse(self, t0: float, t1: float, state: Any = None) -> float:
        """The exact integral over the tick."""
        return self._integral(t1) - self._integral(t0)

    def check(self, duration: float) -> str | None:
        """Keyframes can be evaluated anywhere."""

    @cached_property
    def _areas(self) -> list[float]:
        """The integral from the first key to each key."""
        areas = [0.0]
        for (ta, va), (tb, vb) in zip(self.keys, self.keys[1:], strict=False):
            mean = va if self.interpolation == "hold" else (va + vb) / 2
            areas.append(areas[-1] + mean * (tb - ta))
        return areas

    def _integral(self, t: float) -> float:
        """From the first key to t; negative before it."""
        k = bisect_right(self.keys, t, key=itemgetter(0)) - 1
        if k < 0:
            return (t - self.keys[0][0]) * self.keys[0][1]
        ta, va = self.keys[k]
        if k == len(self.keys) - 1 or self.interpolation == "hold":
            return self._areas[k] + (t - ta) * va
        tb, vb = self.keys[k + 1]
        s = (t - ta) / (tb - ta)
        ramp = s**2 / 2 if self.interpolation == "linear" else s**3 - s**4 / 2
        return self._areas[k] + (tb - ta) * (va * s + (vb - va) * ramp)


@dataclass(frozen=True)
class Formula:
    """A formula of t in seconds, such as `sin(2*pi*t)`.

    Numbers, t, pi, e, + - * / ** %, comparisons, `and`, `or`, `not`, `a if condition else b` and the functions of
    `FUNCTIONS`. The text is parsed into closures over floats; nothing in it is ever executed as Python.
    """

    text: str

    def __call__(self, t: float) -> float:
        """Its value at t. Raises FormulaError."""
        try:
            value = float(self._function(t))
        except ZeroDivisionError:
            raise FormulaError(self._at(t, "divides by zero")) from None
        except (ValueError, OverflowError, TypeError):
            raise FormulaError(self._at(t, "has no finite value")) from None
        if not math.isfinite(value):
            raise FormulaError(self._at(t, "has no finite value"))
        return value

    def impulse(self, t0: float, t1: float, state: Any = None) -> float:
        """The integral by four panels of three Gauss points: exact for a quintic, and able to see a step in a tick."""
        panel = (t1 - t0) / 4
        total = 0.0
        for k in range(4):
            middle = t0 + (k + 0.5) * panel
            total += sum(weight * self(middle + node * panel) for node, weight in _GAUSS)
        return total * panel

    def check(self, duration: float) -> str | None:
        """Raises FormulaError where the formula fails between 0 and `duration`."""
        for k in range(257):
            self(duration * k / 256)

    @cached_property
    def _function(self) -> Callable[[float], Any]:
        return _compiled(self.text)

    def _at(self, t: float, what: str) -> str:
        return f'formula "{self.text}" {what} at t = {t:.6g}'


@dataclass(frozen=True)
class Feedback:
    """A Python function of the state, called once a tick: the paper's force-feedback control. Scripting only."""

    function: Callable[[Any], float]

    def impulse(self, t0: float, t1: float, state: Any = None) -> float:
        """The function's value at the start of the tick times the tick's length."""
        value = float(self.function(state))
        if not math.isfinite(value):
            raise UserError(f"a feedback function returned {value} at t = {t0:.6g}; it must return a finite number")
        return value * (t1 - t0)

    def check(self, duration: float) -> str | None:
        """What a function of the state will return is not known beforehand."""


def _too_late(start: float, duration: float) -> str:
    return f"never acts: it starts at {start:g} s, and the simulation ends at {duration:g} s"


class FormulaError(UserError, ValueError):
    """A formula that cannot be read or has no value."""


class Timed(Model):
    """The time law of a force, as keys of its own table; at most one of them, and `at = 0` when there is none.

    Attributes:
        at: the instant, or instants, in seconds, at which the whole force acts as one impulse.
        during: [t0, t1], the interval in which it acts constantly.
        keys: [[t, value], ...], times rising; before the first and after the last, their values hold.
        interpolation: how `keys` are joined.
        formula: see `Formula`.
        feedback: see `Feedback`; it cannot be written in a recipe.
    """

    at: Annotated[Several[Seconds], Field(min_length=1)] | None = None
    during: tuple[Seconds, Seconds] | None = None
    keys: Annotated[Several[tuple[Seconds, float]], Field(min_length=1)] | None = None
    interpolation: Literal["linear", "smooth", "hold"] = "linear"
    formula: str | None = None
    feedback: Callable[[Any], float] | None = Field(default=None, exclude=True, repr=False)

    @field_validator("at", mode="before")
    @classmethod
    def _listed(cls, at: Any) -> Any:
        if isinstance(at, (int, float)) and not isinstance(at, bool):
            return (at,)
        if at is not None and not isinstance(at, (tuple, list)):
            raise PydanticCustomError("numbers_type", "a number or a list of numbers")
        return at

    @model_validator(mode="after")
    def _one_law(self) -> Self:
        given = [key for key in ("at", "during", "keys", "formula", "feedback") if getattr(self, key) is not None]
        if len(given) > 1:
            raise ValueError(f"has {' and '.join(given)}; keep one of them")
        if self.at and len(set(self.at)) < len(self.at):
            raise ValueError("at names the same instant twice")
        if self.during and self.during[1] <= self.during[0]:
            raise ValueError(f"during = [{self.during[0]:g}, {self.during[1]:g}] ends before it starts")
        if self.keys:
            for (ta, _), (tb, _) in zip(self.keys, self.keys[1:], strict=False):
                if tb <= ta:
                    raise ValueError(f"keys overlap: {tb:g} s comes after {ta:g} s; times must rise")
        if self.interpolation != "linear" and not self.keys:
            raise ValueError("interpolation is for keys, and there are none")
        if self.formula is not None:
            _compiled(self.formula)
        return self

    @property
    def law(self) -> Law:
        """The law these keys spell."""
        if self.during:
            return Interval(*self.during)
        if self.keys:
            return Keyframes(self.keys, self.interpolation)
        if self.formula is not None:
            return Formula(self.formula)
        if self.feedback is not None:
            return Feedback(self.feedback)
        return Instants(self.at or (0.0,))

    @property
    def span(self) -> tuple[float, float] | None:
        """The seconds from its first instant or key to its last; None where a formula of the time says when it acts."""
        if self.during:
            return self.during
        if self.formula is not None or self.feedback is not None:
            return None
        times = [time for time, _ in self.keys] if self.keys else self.at or (0.0,)
        return min(times), max(times)

    @property
    def starts_at(self) -> float:
        """The seconds before which it does nothing."""
        if self.span is None or (self.keys and self.keys[0][1]):
            return 0.0
        return self.span[0]

    def spanning(self, start: float, end: float) -> dict[str, Any]:
        """The keys of the same law between two times; of a formula, none."""
        if self.span is None:
            return {}
        first, last = self.span

        def at(time: float) -> float:
            # To a billionth of a second, so that moving it there and back leaves no digits behind.
            part = (time - first) / (last - first) if last > first else 0.0
            return round(start + part * (end - start), 9)

        if self.during:
            return {"during": (at(first), at(last))}
        if self.keys:
            return {"keys": tuple((at(time), value) for time, value in self.keys)}
        return {"at": tuple(at(time) for time in self.at or (0.0,))}


# --- the formula's language ---------------------------------------------------------------------------------------

_GAUSS = ((-math.sqrt(0.15), 5 / 18), (0.0, 8 / 18), (math.sqrt(0.15), 5 / 18))
_LONGEST = 500
_DEEPEST = 50


def _step(x: float) -> float:
    return 1.0 if x >= 0 else 0.0


def _pulse(t: float, start: float, end: float) -> float:
    return 1.0 if start <= t < end else 0.0


def _smoothstep(a: float, b: float, x: float) -> float:
    s = min(1.0, max(0.0, (x - a) / (b - a)))
    return s * s * (3 - 2 * s)


FUNCTIONS: dict[str, tuple[Callable[..., Any], int | None]] = {
    **{
        name: (getattr(math, name), 1)
        for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "floor")
    },
    "ceil": (math.ceil, 1),
    "atan2": (math.atan2, 2),
    "abs": (abs, 1),
    "min": (min, None),
    "max": (max, None),
    "step": (_step, 1),
    "pulse": (_pulse, 3),
    "smoothstep": (_smoothstep, 3),
}
"""What a formula may call, and with how many arguments (None: two or more)."""

_CONSTANTS = {"pi": math.pi, "e": math.e}

_BINARY: dict[type, Callable[[float, float], float]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Mod: lambda a, b: a % b,
    # Floats only, so 9**9**9 overflows at once instead of eating the machine; math.pow has no complex results.
    ast.Pow: math.pow,
}
_COMPARE: dict[type, Callable[[float, float], bool]] = {
    ast.Lt: lambda a, b: a < b,
    ast.LtE: lambda a, b: a <= b,
    ast.Gt: lambda a, b: a > b,
    ast.GtE: lambda a, b: a >= b,
    ast.Eq: lambda a, b: a == b,
    ast.NotEq: lambda a, b: a != b,
}


def _compiled(text: str) -> Callable[[float], Any]:
    """The formula as a function of t. Raises FormulaError naming what is not understood."""
    if len(text) > _LONGEST:
        raise FormulaError(f"formula is longer than {_LONGEST} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise FormulaError(f'formula "{text}" cannot be read; write for example "sin(2*pi*t)"') from None

    def refuse(what: str) -> FormulaError:
        return FormulaError(f'formula "{text}" {what}')

    def build(node: ast.AST, depth: int = 0) -> Callable[[float], Any]:
        if depth > _DEEPEST:
            raise refuse("is nested too deeply")

        def sub(child: ast.AST) -> Callable[[float], Any]:
            return build(child, depth + 1)

        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                try:
                    value = float(number)
                except OverflowError:
                    raise refuse("holds a number too large") from None
                return lambda t: value
            case ast.Name(id="t"):
                return lambda t: t
            case ast.Name(id=name) if name in _CONSTANTS:
                return lambda t: _CONSTANTS[name]
            case ast.Name(id=name) if name in FUNCTIONS:
                raise refuse(f'names "{name}", which is a function; write {name}(...)')
            case ast.Name(id=name):
                raise refuse(f'names "{name}", which is not known; known are t, {", ".join(_CONSTANTS)}')
            case ast.BinOp(op=op) if type(op) in _BINARY:
                apply, left, right = _BINARY[type(op)], sub(node.left), sub(node.right)
                return lambda t: apply(left(t), right(t))
            case ast.UnaryOp(op=ast.USub()):
                operand = sub(node.operand)
                return lambda t: -operand(t)
            case ast.UnaryOp(op=ast.UAdd()):
                return sub(node.operand)
            case ast.UnaryOp(op=ast.Not()):
                operand = sub(node.operand)
                return lambda t: not operand(t)
            case ast.BoolOp(op=op):
                parts = [sub(value) for value in node.values]
                every = all if isinstance(op, ast.And) else any
                return lambda t: every(part(t) for part in parts)
            case ast.Compare(ops=ops) if all(type(op) in _COMPARE for op in ops):
                terms = [sub(node.left), *(sub(other) for other in node.comparators)]
                tests = [_COMPARE[type(op)] for op in ops]
                return lambda t: all(test(a(t), b(t)) for test, a, b in zip(tests, terms, terms[1:], strict=False))
            case ast.IfExp():
                test, then, otherwise = sub(node.test), sub(node.body), sub(node.orelse)
                return lambda t: then(t) if test(t) else otherwise(t)
            case ast.Call(func=ast.Name(id=name), keywords=[]):
                if name not in FUNCTIONS:
                    raise refuse(f'calls "{name}", which is not known; known are {", ".join(FUNCTIONS)}')
                function, wanted = FUNCTIONS[name]
                if (wanted is None and len(node.args) < 2) or (wanted is not None and len(node.args) != wanted):
                    raise refuse(f'gives "{name}" {len(node.args)} numbers; it takes {wanted or "two or more"}')
                arguments = [sub(argument) for argument in node.args]
                return lambda t: function(*(argument(t) for argument in arguments))
        part = ast.get_source_segment(text.strip(), node)
        raise refuse(f'holds "{part}", which is not allowed in a formula')

    return build(tree.body)
