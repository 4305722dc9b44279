"""Reading TOML that anybody may have written: looked through for what costs too much before it is parsed.

The time and memory of the standard library's parser grow with the square of the parts of a dotted key, and with every
level of nesting by a few levels of the interpreter's own stack.
"""

from __future__ import annotations

import re
import tomllib
from typing import Any

from app.errors import UserError

DEEPEST = 16  # brackets within each other
MOST_PARTS = 16  # of a dotted key
LONGEST_WORD = 200  # characters of a number, or of a key without quotes
LONGEST_STRING = 10_000
MOST_WORDS = 200_000  # keys, values and brackets, but for those of lists of numbers; a stroke has about 20

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
    """,
    re.VERBOSE | re.DOTALL,
)


def parsed(text: str, source: str) -> dict[str, Any]:
    """The table that `text`, of the file `source`, holds. Raises `UserError` naming the file and the line."""
    _check(text, source)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        # tomllib's own words for a key that is written a second time.
        said = str(error).replace("Cannot overwrite a value", "the same key is given twice")
        raise UserError(f"{source} is not valid TOML: {said}") from None
    except ValueError as error:  # a date or a number that there is not
        raise UserError(f"{source} is not valid TOML: {error}") from None


def _check(text: str, source: str) -> None:
    """Raise `UserError` for what no recipe needs and a parser suffers from."""

    def refuse(at: int, what: str) -> UserError:
        line = text.count("\n", 0, at) + 1
        return UserError(f"{source}, line {line}: {what}, which is more than any recipe needs; get it again")

    depth = dots = words = 0
    for token in _TOKENS.finditer(text):
        kind, length = token.lastgroup, token.end() - token.start()
        words += kind in ("word", "string") or token[0] in ("[", "{")
        if words > MOST_WORDS:
            raise refuse(token.start(), f"the {words}th of its keys, values and brackets")
        if kind == "word" and length > LONGEST_WORD:
            raise refuse(token.start(), f"a number or a key of {length} characters")
        elif kind == "string" and length > LONGEST_STRING:
            raise refuse(token.start(), f"a text of {length} characters")
        elif kind == "unfinished":
            return  # the parser goes no further, and says so
        elif kind == "mark":
            mark = token[0]
            dots = dots + 1 if mark == "." else 0
            depth = depth + 1 if mark in "[{" else max(0, depth - 1) if mark in "]}" else depth
            if depth > DEEPEST:
                raise refuse(token.start(), f"lists or tables nested more than {DEEPEST} deep")
            if dots >= MOST_PARTS:
                raise refuse(token.start(), f"a key of more than {MOST_PARTS} parts")
