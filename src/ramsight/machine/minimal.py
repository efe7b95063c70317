"""A description with what is needed alone: without defaults, and without what a model or a circuit gives."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from ramsight.errors import UnknownNameError
from ramsight.machine import catalogue
from ramsight.machine.assumptions import Assumptions
from ramsight.machine.base import Part
from ramsight.machine.declare import declaration, explain
from ramsight.machine.description import Composed, Machine, Unit, circuits
from ramsight.machine.reading import load
from ramsight.machine.template import yours
from ramsight.machine.tolerances import Tolerances

_HEAD = """\
# {name}, with the values of {of}: replace those marked "yours:", which nothing else gives. Then: ramsight check FILE
# Every value with its unit, any of the right kind; pressures are absolute, a setting is above the tank's.
# What has a default is left out; 'ramsight new FILE --like {like}' shows all of it."""


def example_of(circuit: str) -> tuple[Machine, str]:
    """A machine of the catalogue with a circuit, and the unit that has it.

    Args:
        circuit: its name.

    Raises:
        UnknownNameError: there is no such circuit, or no machine has it.
    """
    found: dict[str, tuple[Machine, str]] = {}
    for entry in catalogue.entries():
        if entry.kind == "machine":
            machine = load(entry.name)
            for name, unit in machine.units.items():
                found.setdefault(unit.circuit, (machine, name))
    if circuit not in found:
        raise UnknownNameError("circuit", circuit, set(circuits()) & set(found))
    return found[circuit]


def alone(machine: Machine, unit: str, name: str) -> Machine:
    """A machine with one unit of another, by another name, and no mechanism.

    Args:
        machine: the other machine.
        unit: its unit.
        name: what the unit is called here.
    """
    return machine.model_copy(update={"units": {name: machine.unit(unit)}, "linkage": None})


def minimal(machine: Machine, name: str = "my-machine") -> str:
    """Write a description with what is needed alone.

    Args:
        machine: whose values stand in it.
        name: the name of the new machine.

    Returns:
        TOML text.

    Example:
        >>> from ramsight import machine
        >>> text = minimal(alone(*example_of("ddh"), name="arm"))
        >>> len(text.splitlines()) < 80, machine.loads(text).unit("arm") == machine.load("mining-loader").unit("boom")
        (True, True)
    """
    head = _HEAD.format(name=name, of=machine.title or machine.name, like=machine.name)
    lines = [head, "format = 1", f"name = {json.dumps(name)}"]
    for unit_name, unit in machine.units.items():
        lines += ["", f"[units.{unit_name}]"]
        fields = type(unit).model_fields
        for key in ("circuit", "load_direction"):
            lines.append(_line(key, getattr(unit, key), yours(type(unit), key, {}) + explain(fields[key])))
        close = False  # parts of a circuit stand together
        for path, part, places in _parts(unit):
            values = list(_values(part, places))
            if values:
                apart = [] if close else [""]
                close = path.startswith("parts.")
                lines += [*apart, f"[units.{unit_name}.{path}]", *values]
    return "\n".join(lines) + "\n"


def _parts(unit: Unit) -> Iterator[tuple[str, Part, Mapping[str, Any]]]:
    """Path and part of everything but assumptions and tolerances, and what the circuit says of it."""
    for key, value in unit:
        if isinstance(value, Part) and not isinstance(value, Assumptions | Tolerances):
            yield key, value, {}
    if isinstance(unit, Composed):
        named = {entry.name for entry in catalogue.entries() if entry.kind == "circuit"}
        given = catalogue.circuit(unit.circuit) if unit.circuit in named else {}
        for key, part in unit.parts.items():
            yield f"parts.{key}", part, given.get(key, {})


def _values(part: Part, places: Mapping[str, Any]) -> Iterator[str]:
    model = getattr(part, "model", None)
    given = {} if model is None else catalogue.read(catalogue.find(part.family, model))[0]
    for key, field in type(part).model_fields.items():
        value, declared = getattr(part, key), declaration(field)
        if value is None or key in places or value == field.default:
            continue
        if isinstance(value, dict):
            inner = ", ".join(f'{name} = "{item / 1e3:g} kN"' for name, item in value.items())
            yield f"{f'{key} = {{ {inner} }}':<40}  # {explain(field)}"
        elif declared is None:
            yield _line(key, value, yours(type(part), key, given) + explain(field))
        elif key not in given or declared.read(given[key], from_file=True) != value:
            text = declared.show(value)
            words = yours(type(part), key, given) + explain(field)
            bare = declared.whole or (declared.unit == "1" and "/" not in text)
            yield _line(key, float(text) if bare and not declared.whole else value if bare else text, words)


def _line(key: str, value: Any, words: str) -> str:
    written = value if isinstance(value, int | float) else json.dumps(value, ensure_ascii=False)
    return f"{f'{key} = {written}':<40}  # {words}"
