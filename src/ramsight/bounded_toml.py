"""TOML that somebody else may have written: its size and depth are limited before it is read.

The standard library's reader takes memory by the square of a dotted key's length, and a thousand bytes for each table.
What it would go through is looked at first, in one pass that needs no more than the text.
"""

from __future__ import annotations

import re
import tomllib
from typing import Any

LARGEST = 1 << 20
"""Bytes of a file. The largest of the catalogue has 15 kB; an efficiency map of 10 000 points has 300 kB."""
DEEPEST = 16
"""Parts of a dotted key, brackets in brackets, tables in tables. Descriptions use up to 6."""
MOST = 20_000
"""Values and tables. A machine with every key of the schema has 600."""
LONGEST_WORD = 1000
"""Letters of a name or digits of a number outside quotes; the largest number of a double has 309."""

_TOKEN = re.compile(
    r"""
    "{3} (?: [^"\\]++ | \\. | "(?!"") )*+ "{3}
    | '{3} (?: [^']++ | '(?!\'\') )*+ '{3}
    | (?! "{3} | '{3} ) (?: " (?: [^"\\\n]++ | \\. )*+ " | ' [^'\n]*+ ' )
    | \# [^\n]*+
    | [\[\]{}=,.]
    | [^\[\]{}=,."'\#]++
    """,
    re.VERBOSE | re.DOTALL,
)
_ESCAPE = re.compile(r"\\(?:([bfre])|[xuU]([0-9A-Fa-f]{2,8})|.)", re.DOTALL)
_OPEN = frozenset("\"'[]{}")  # what begins a text, a list or a table
_WORD = re.compile(rf"\S{{{LONGEST_WORD + 1}}}")


class TomlError(ValueError):
    """A text that is no TOML, or too much of it; the text says what, `line` where."""

    def __init__(self, message: str, line: int) -> None:
        self.line = line
        super().__init__(message)


def loads(text: str) -> dict[str, Any]:
    """What a TOML text holds.

    Raises:
        TomlError: it is no TOML, or larger or deeper than any file of a person.

    Example:
        >>> loads("a.b = 1")
        {'a': {'b': 1}}
        >>> loads(".".join("a" * 50_000) + " = 1")
        Traceback (most recent call last):
        ...
        ramsight.bounded_toml.TomlError: nested too deeply (allowed: 16 levels)
    """
    if len(text) > LARGEST:
        raise TomlError(f"too large (allowed: up to {LARGEST >> 20} MiB)", 1)
    _look_through(text)
    try:
        found = tomllib.loads(text.replace("\r\n", "\n"))
    except tomllib.TOMLDecodeError as error:
        words = str(error)
        match = re.fullmatch(r"(.*) \(at line ([0-9]+), column ([0-9]+)\)", words, re.DOTALL)
        line = int(match[2]) if match else text.count("\n") + 1
        words = (match[1] if match else words.removesuffix(" (at end of document)")).strip()
        raise TomlError(f"{words}{_without_quotes(text, line)}", line) from None
    except (ValueError, RecursionError) as error:  # a date that is none, a number that no integer can be
        raise TomlError(f"cannot be read: {error}", 1) from None
    if _is_deeper(found, DEEPEST):
        raise TomlError(f"nested too deeply (allowed: {DEEPEST} levels)", 1)
    return found


def _without_quotes(text: str, line: int) -> str:
    """What to write where a line has a text without quotation marks; nothing where that is not what is wrong."""
    lines = text.splitlines()
    key, _, rest = lines[line - 1].partition("=") if line <= len(lines) else ("", "", "")
    value = rest.partition("#")[0].strip()
    if not any(one.isalpha() for one in value) or not _OPEN.isdisjoint(value) or len(value) > LONGEST_WORD:
        return ""
    return f'; a text and a number with a unit have quotation marks: {key.strip()} = "{value}"'


def _look_through(text: str) -> None:
    """Refuse a text that is too much; what is no TOML ends the look, as it will end the reading."""
    depth = dots = count = place = 0
    while (match := _TOKEN.match(text, place)) is not None:
        token, place = match[0], match.end()
        if token in ("[", "{"):
            depth, dots, count = depth + 1, 0, count + 1
        elif token in ("]", "}"):
            depth, dots = max(depth - 1, 0), 0
        elif token in ("=", ","):
            dots, count = 0, count + 1
        elif token == ".":
            dots, count = dots + 1, count + 1  # each part of a key is a table
        elif token[0] == '"':
            _refuse_controls(text, token, place - len(token))
        elif token[0] not in "\"'#":
            if "\n" in token:
                dots = 0
            if len(token) > LONGEST_WORD and _WORD.search(token):
                raise TomlError(f"a name or a number is too long (allowed: {LONGEST_WORD} letters)", _line(text, place))
        if max(depth, dots + 1) > DEEPEST:
            raise TomlError(f"nested too deeply (allowed: {DEEPEST} levels)", _line(text, place))
        if count > MOST:
            raise TomlError(f"too many values and tables (allowed: {MOST})", _line(text, place))


def _refuse_controls(text: str, token: str, begins: int) -> None:
    """Refuse what a terminal or an XML file takes for a command: control characters but the end of a line and a tab."""
    for one in _ESCAPE.finditer(token):
        code = int(one[2], 16) if one[2] else None
        if one[1] or (code is not None and code not in (9, 10) and (code < 0x20 or 0x7F <= code < 0xA0)):
            raise TomlError(f"a text holds the control character {one[0]}", _line(text, begins + one.start()))


def _line(text: str, place: int) -> int:
    return text.count("\n", 0, place) + 1


def _is_deeper(value: Any, most: int) -> bool:
    """Whether tables and lists are in each other more often than so."""
    level = [value]
    for _ in range(most):
        inner: list[Any] = []
        for one in level:
            inner += one.values() if isinstance(one, dict) else one if isinstance(one, list) else ()
        level = [one for one in inner if isinstance(one, dict | list)]
        if not level:
            return False
    return True
