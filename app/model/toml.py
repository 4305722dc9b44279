"""Reading TOML that anybody may have written: looked through for what costs too much before it is parsed.

The time and memory of the standard library's parser grow with the square of the parts of a dotted key, and with every
level of nesting by a few levels of the interpreter's own stack.
"""

from __future__ import annotations

import json
import re
import tomllib
from itertools import chain
from typing import Any

from app.errors import UserError

DEEPEST = 16  # brackets within each other
MOST_PARTS = 16  # of a dotted key
LONGEST_WORD = 200  # characters of a number, or of a key without quotes
LONGEST_STRING = 10_000
MOST_WORDS = 200_000  # keys, values and brackets, but for those of lists of numbers; a stroke has about 20
MOST_MARKS = 3 * MOST_WORDS  # commas, dots, signs of equality and brackets: words are parted by fewer
MOST_NUMBERS = 2_000_000  # in lists of them; of an hour's painting there are 432,000, four to a tick
MOST_LINES = 500_000  # of which each costs a parser as much as a word, if there is nothing on it
LONG = 200  # characters of lists of numbers that are worth being read by json
_MARK = "\ue000"  # begins what stands where they were, a character that nobody writes
_MARKED = re.compile(rf"{_MARK}|\\[uU]0*+[eE]000")

_NUMBER = r"[+-]?[0-9][0-9_.eE+-]{0,40}+"
# Every repetition keeps what it has taken (its second +), so that the time is proportional to the length of the text.
# In Python 3.11.2 (Debian 12) one finds nothing if its last try fails after taking something: the comma comes first.
_TOKENS = re.compile(
    rf"""
    (?:\[\ *+{_NUMBER}\ *+(?:,\ *+{_NUMBER}\ *+){{0,15}}+\]\ *+,?\ *+)++  # lists of numbers: nearly all of a recipe
    | (?P<word> [\w+:-]++)
    | (?P<string> \"{{3}}(?:[^"\\]|\\.|"(?!""))*+"{{3,5}} | '{{3}}(?:[^']|'(?!''))*+'{{3,5}}
        # Three quotes without an end are no empty text and a quote, or what follows would be searched again and again.
        | (?!\"{{3}}|'{{3}}) (?: "(?:[^"\\\n]|\\[^\n])*+" | '[^'\n]*+'))
    | (?P<unfinished> \"{{3}} | '{{3}} | ["'])
    | \#[^\n]*+
    | (?P<mark> [][{{}}.,=\n])
    | [^][{{}}.,=\n\w+:"'\#-]{{9,}}+  # spaces, and what belongs nowhere: each would be looked at by all of the above
    """,
    re.VERBOSE | re.DOTALL,
)


def parsed(text: str, source: str) -> dict[str, Any]:
    """The table that `text`, of the file `source`, holds; in it long rows of lists of numbers are tuples of tuples.

    Raises `UserError` naming the file and the line.
    """
    rows, end = _check(text, source)
    rest, lists = _without(rows, text[:end])
    try:
        return _with(lists, tomllib.loads(rest))
    except tomllib.TOMLDecodeError as error:
        # tomllib's own words for a key that is written a second time.
        said = str(error).replace("Cannot overwrite a value", "the same key is given twice")
        raise UserError(
            f"{source} is not valid TOML: {re.sub(', column [0-9]+', '', said) if lists else said}"
        ) from None
    except ValueError as error:  # a date or a number that there is not
        raise UserError(f"{source} is not valid TOML: {error}") from None


def _without(rows: list[tuple[int, int]], text: str) -> tuple[str, dict[str, tuple[Any, ...]]]:
    """`text` with marks in the place of rows of lists, and what they stand for.

    tomllib takes 20 times as long over a number as json; what is a number there is the same number in TOML.
    """
    lists: dict[str, tuple[Any, ...]] = {}
    pieces, end = [], 0
    for start, stop in () if _MARKED.search(text) else rows:
        row = text[start:stop].rstrip(" ,")
        try:
            read = tuple(map(tuple, json.loads(f"[{row}]")))
        except ValueError:  # as only TOML writes numbers, or a mistake
            continue
        mark = f"{_MARK}{len(lists)}"
        lists[mark] = read
        pieces += text[end:start], f'{{"{mark}"=0}}'  # which is wrong wherever a list would be
        end = start + len(row)
    return "".join((*pieces, text[end:])), lists


def _with(lists: dict[str, tuple[Any, ...]], value: Any) -> Any:
    """A value with the lists themselves where there are marks in it."""
    if not lists:
        return value
    if isinstance(value, dict):
        return {key: _with(lists, part) for key, part in value.items()}
    if not isinstance(value, list):
        return value
    first = (next(iter(part), "") if isinstance(part, dict) else "" for part in value)
    rows = (lists.get(mark) or (_with(lists, part),) for mark, part in zip(first, value, strict=True))
    return tuple(chain.from_iterable(rows))


def _check(text: str, source: str) -> tuple[list[tuple[int, int]], int]:
    """Raise `UserError` for what no recipe needs and a parser suffers from.

    Returns where long rows of lists of numbers are; and how much of `text` the parser needs to say what is wrong.
    """

    def refuse(at: int, what: str) -> UserError:
        line = text.count("\n", 0, at) + 1
        return UserError(f"{source}, line {line}: {what}, which is more than any recipe needs; get it again")

    if text.count("\n") > MOST_LINES:
        raise UserError(f"{source} has more than {MOST_LINES} lines, more than any recipe needs; get it again")
    rows: list[tuple[int, int]] = []
    depth = dots = words = marks = numbers = 0
    end = len(text)
    before = ""  # the last mark, if nothing came after it
    for token in _TOKENS.finditer(text):
        kind, length = token.lastgroup, token.end() - token.start()
        if kind is None and text[token.start()] == "[":
            numbers += text.count(",", *token.span()) + 1
            if numbers > MOST_NUMBERS:
                raise refuse(token.end(), f"more than {MOST_NUMBERS} numbers in lists")
            if length > LONG and before in ("[", ","):  # elsewhere it may not stand, as the parser will say
                rows.append(token.span())
            before = "]"
            continue
        before = token[0] if kind == "mark" and token[0] != "\n" else before if kind in (None, "mark") else ""
        words += kind in ("word", "string") or token[0] in ("[", "{")
        if words > MOST_WORDS:
            raise refuse(token.start(), f"the {words}th of its keys, values and brackets")
        if kind == "word" and length > LONGEST_WORD:
            raise refuse(token.start(), f"a number or a key of {length} characters")
        elif kind == "string" and length > LONGEST_STRING:
            raise refuse(token.start(), f"a text of {length} characters")
        elif kind == "unfinished":
            end = token.end() + LONGEST_STRING  # the parser goes no further than its end, and says so
            break
        elif kind == "mark":
            mark = token[0]
            marks += mark != "\n"
            if marks > MOST_MARKS:
                raise refuse(token.start(), f"the {marks}th of its commas, dots, signs of equality and brackets")
            dots = dots + 1 if mark == "." else 0
            depth = depth + 1 if mark in "[{" else max(0, depth - 1) if mark in "]}" else depth
            if depth > DEEPEST:
                raise refuse(token.start(), f"lists or tables nested more than {DEEPEST} deep")
            if dots >= MOST_PARTS:
                raise refuse(token.start(), f"a key of more than {MOST_PARTS} parts")
    return rows, end
