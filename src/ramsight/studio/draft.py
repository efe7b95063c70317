"""A description that is being written: its text, what a form shows of it, what is wrong with it, what follows from it.

The text is all there is. A form is a view of it, so a value that cannot be used stays in it, and is reported as wrong.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from ramsight import bounded_toml
from ramsight.api.abilities import abilities
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.machine import catalogue, loads
from ramsight.machine.as_toml import as_toml
from ramsight.machine.base import Value, walk
from ramsight.machine.catalogue import parse_toml
from ramsight.machine.description import Machine
from ramsight.plant.machine_tables import machine_summary

NAMED = "description"
"""What errors call a description that is no file."""
_BESIDE = {"value", "source", "tolerance"}
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_WIDE = 110  # columns of what follows from a description


@dataclass(frozen=True)
class Row:
    """One value as a form shows it."""

    path: str  # dotted, as errors name it
    text: str  # as it stands in the description; "" if it is not there
    usual: str  # what holds then: the catalogue's or the default; "" if the description has to say it
    meaning: str
    # unit, range: as declared; "" for words
    unit: str
    range: str
    source: str  # where it comes from


@dataclass(frozen=True)
class Problem:
    """What is wrong with a description: where, "" if nowhere alone, and in words."""

    path: str
    words: str


def read(text: str) -> Machine | Problem:
    """A description from its text, or what is wrong with it.

    Example:
        >>> from ramsight import machine
        >>> text = machine.template()
        >>> wrong = edited(text, machine.loads(text), "units.boom.cylinder.bore", "3 m")
        >>> read(wrong)
        Problem(path='units.boom.cylinder.bore', words='out of range (allowed: at least 1 mm, at most 1 m)')
    """
    try:
        return loads(text, NAMED)
    except DescriptionError as error:
        return problem(error)
    except UnknownNameError as error:
        place = (error.where or "").removeprefix(NAMED).removeprefix(": ")
        words = str(error).removeprefix(f"{error.where}: ")
        return Problem(f"{place}.model" if place else "", words)


def problem(error: DescriptionError) -> Problem:
    """What an error says is wrong with a description."""
    allowed = f" (allowed: {error.allowed})" if error.allowed else ""
    return Problem(error.key or "", f"{error.message}{allowed}")


def rows(text: str, machine: Machine) -> list[Row]:
    """What a form shows: every value of a machine, with what the text says of it.

    Args:
        text: TOML that can be read, though what it says may be wrong.
        machine: the last one that could be used; it states which values there are.
    """
    written = bounded_toml.loads(text)
    return [_row(written, value, machine) for value in walk(machine) if value.path != "format"]


def _row(written: Mapping[str, Any], value: Value, machine: Machine) -> Row:
    leaf = _leaf(written, value.path)
    plain = leaf.get("value") if isinstance(leaf, dict) else leaf
    plain = ", ".join(map(str, plain)) if isinstance(plain, list) else plain
    declared = value.declared
    if leaf is not None:
        source = _source(written, value.path)
    else:
        source = (machine.source_of(value.path) or "") if value.given else "default"
    return Row(
        value.path,
        "" if plain is None else str(plain).lower() if isinstance(plain, bool) else str(plain),
        value.shown if plain is None else "",
        value.text,
        declared.unit if declared is not None else "",
        declared.range if declared is not None else "",
        source,
    )


def edited(text: str, machine: Machine, path: str, value: str | None = None, source: str | None = None) -> str:
    """A description's text after an edit; comments are lost.

    Args:
        value: as it is to stand there; "" takes it away, so that the catalogue's or the default holds. A new value
            loses its source. None leaves it.
        source: where it comes from; None leaves that.
    """
    written = bounded_toml.loads(text)
    *tables, name = path.split(".")
    table = written
    for one in tables:
        table = table.setdefault(one, {})
    leaf = table.get(name)
    beside = dict(leaf) if isinstance(leaf, dict) else {} if leaf is None else {"value": leaf}
    if value is not None:
        beside = {"value": _typed(value, machine, path)}
    if source is not None:
        beside.setdefault("value", _shown(machine, path))
        beside["source"] = source
    beside = {key: one for key, one in beside.items() if one != ""}
    if "value" not in beside:
        table.pop(name, None)
    else:
        table[name] = beside if len(beside) > 1 else beside["value"]
    return "\n".join(_tables(written)) + "\n"


def follows(machine: Machine) -> str:
    """What follows from a description, as `ramsight check` says it."""
    out = io.StringIO()
    Console(file=out, width=_WIDE, highlight=False, color_system=None).print(machine_summary(machine))
    for name in machine.units:
        out.write(f"\nwhat {name} can have\n")
        out.writelines(f"{one.text}\n" for one in abilities(machine, unit=name))
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines()) + "\n"


def text_of(machine: Machine) -> str:
    """A description's text: that of its file, comments and all, or one that states the same."""
    if catalogue.has("machine", machine.origin):
        return catalogue.find("machine", machine.origin).path.read_text(encoding="utf-8")
    try:
        return Path(machine.origin).read_text(encoding="utf-8-sig")
    except OSError:
        return "\n".join(as_toml(machine, machine.sources)) + "\n"


def can_be_read(text: str) -> Problem | None:
    """Why a text is no TOML; None if it is."""
    try:
        parse_toml(text, NAMED)
    except DescriptionError as error:
        return Problem("", error.message)
    return None


def _leaf(written: Mapping[str, Any], path: str) -> Any:
    found: Any = written
    for step in path.split("."):
        if not isinstance(found, dict) or step not in found:
            return None
        found = found[step]
    return found if not isinstance(found, dict) or found.keys() <= _BESIDE else None


def _source(written: Mapping[str, Any], path: str) -> str:
    """Where a value that is written comes from: it states so itself, or the nearest table around it."""
    steps, found = path.split("."), ""
    table: Any = written
    for step in steps:
        found = table.get("source", found)
        table = table[step]
    return str(table.get("source", "") or found) if isinstance(table, dict) else str(found)


def _shown(machine: Machine, path: str) -> Any:
    return next((_typed(value.shown, machine, path) for value in walk(machine) if value.path == path), "")


def _typed(text: str, machine: Machine, path: str) -> Any:
    """A text as TOML has it: numbers without a unit as numbers where numbers belong, all else as text."""
    text = text.strip()
    value = next((one for one in walk(machine) if one.path == path), None)
    if value is not None and isinstance(value.value, tuple):
        return [one.strip() for one in text.split(",")]
    if value is None or (value.declared is not None and value.declared.unit != "1"):
        return text
    if value.declared is None and not isinstance(value.value, bool | int | float):
        return text
    try:
        found = bounded_toml.loads(f"value = {text}")["value"]
    except bounded_toml.TomlError:
        return text
    return found if isinstance(found, bool | int | float) else text


def _tables(table: Mapping[str, Any], path: str = "") -> Iterator[str]:
    """Lines of a table: its own values first, then the tables in it."""
    own = {key: one for key, one in table.items() if not isinstance(one, dict) or _is_value(one)}
    if path and own:
        yield from ("", f"[{path}]")
    for key, one in own.items():
        yield f"{_key(key)} = {_written(one)}"
    for key, one in table.items():
        if key not in own:
            yield from _tables(one, f"{path}.{_key(key)}" if path else _key(key))


def _is_value(one: Mapping[str, Any]) -> bool:
    return "value" in one and one.keys() <= _BESIDE


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _written(one: Any) -> str:
    if isinstance(one, dict):
        return "{ " + ", ".join(f"{_key(key)} = {_written(value)}" for key, value in one.items()) + " }"
    if isinstance(one, list):
        return "[" + ", ".join(_written(value) for value in one) + "]"
    if isinstance(one, str):
        return json.dumps(one, ensure_ascii=False).replace("\x7f", "\\u007f")
    return str(one).lower() if isinstance(one, bool) else str(one)
