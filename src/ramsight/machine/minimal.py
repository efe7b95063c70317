"""A description with what is needed alone: without defaults, and without what a model or a circuit gives."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from ramsight.errors import UnknownNameError
from ramsight.machine import catalogue
from ramsight.machine.assumption_description import Assumptions
from ramsight.machine.base import Part
from ramsight.machine.declare import declaration, explain
from ramsight.machine.description import Composed, Machine, Unit, circuits
from ramsight.machine.reading import load_machine
from ramsight.machine.template import yours
from ramsight.machine.tolerances import Tolerances

_HEAD = """\
# {name}, with the values of {of}: replace those marked "yours:", which nothing else gives. Then: ramsight check FILE
# Every value with its unit, any of the right kind; pressures are absolute, a setting is above the tank's.
# What has a default is left out; 'ramsight new FILE --like {like}' shows all of it."""

_SMALL = 2  # values up to which a part has no table of its own: short enough to be read without one


def example_of(circuit: str) -> tuple[Machine, str]:
    """A machine of the catalogue with a circuit, and the unit that has it.

    Raises:
        UnknownNameError: there is no such circuit, or no machine has it.
    """
    found: dict[str, tuple[Machine, str]] = {}
    for entry in catalogue.entries():
        if entry.kind == "machine":
            machine = load_machine(entry.name)
            for name, unit in machine.units.items():
                found.setdefault(unit.circuit, (machine, name))
    if circuit not in found:
        raise UnknownNameError("circuit", circuit, set(circuits()) & set(found))
    return found[circuit]


def alone(machine: Machine, unit: str, name: str) -> Machine:
    """A machine with one unit of another, by another name, and no mechanism."""
    return machine.model_copy(update={"units": {name: machine.unit(unit)}, "linkage": None})


def minimal(machine: Machine, name: str = "my-machine") -> str:
    """Write a description with what is needed alone.

    Returns:
        TOML text.

    Example:
        >>> from ramsight import machine
        >>> text = minimal(alone(*example_of("ddh"), name="arm"))
        >>> loader = machine.load_machine("mining-loader")
        >>> len(text.splitlines()) < 80, machine.loads(text).unit("arm") == loader.unit("boom")
        (True, True)
    """
    head = _HEAD.format(name=name, of=machine.title or machine.name, like=machine.name)
    lines = [head, "format = 1", f"name = {json.dumps(name)}"]
    for unit_name, unit in machine.units.items():
        lines += ["", f"[units.{unit_name}]", *_unit(unit, f"units.{unit_name}")]
    return "\n".join(lines) + "\n"


def _unit(unit: Unit, path: str) -> Iterator[str]:
    """Lines of a unit: its words and small parts as keys of its own, then a table for each larger part."""
    fields = type(unit).model_fields
    for key in ("circuit", "load_direction"):
        words = yours(type(unit), key, {}) + explain(fields[key])
        yield f"{_aligned(_written(key, getattr(unit, key)))}  # {words}"
    tables: list[str] = []
    close = False  # parts of a circuit stand together
    for name, part, places in _parts(unit):
        values = list(_values(part, places))
        if len(values) <= _SMALL:
            yield from (f"{_aligned(f'{name}.{text}')}  # {words}" for text, words in values)
        else:
            apart = [] if close else [""]
            close = name.startswith("parts.")
            tables += [*apart, f"[{path}.{name}]", *(f"{_aligned(text)}  # {words}" for text, words in values)]
    yield from tables


def _parts(unit: Unit) -> Iterator[tuple[str, Part, Mapping[str, Any]]]:
    """Path and part of everything but assumptions and tolerances, and what the circuit states of it."""
    for key, value in unit:
        if isinstance(value, Part) and not isinstance(value, Assumptions | Tolerances):
            yield key, value, {}
    if isinstance(unit, Composed):
        named = {entry.name for entry in catalogue.entries() if entry.kind == "circuit"}
        stated = catalogue.circuit(unit.circuit) if unit.circuit in named else {}
        for key, part in unit.parts.items():
            yield f"parts.{key}", part, stated.get(key, {})


def _values(part: Part, places: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Key and value of what is needed of a part, and what it means."""
    model = getattr(part, "model", None)
    stated = {} if model is None else catalogue.read(catalogue.find(part.family, model))[0]
    for key, field in type(part).model_fields.items():
        value, declared = getattr(part, key), declaration(field)
        if value is None or key in places or value == field.default:
            continue
        if isinstance(value, dict):
            inner = ", ".join(f'{name} = "{item / 1e3:g} kN"' for name, item in value.items())
            yield f"{key} = {{ {inner} }}", explain(field)
        elif declared is None:
            yield _written(key, value), yours(type(part), key, stated) + explain(field)
        elif key not in stated or declared.read(stated[key], from_file=True) != value:
            text = declared.show(value)
            words = yours(type(part), key, stated) + explain(field)
            bare = declared.whole or (declared.unit == "1" and "/" not in text)
            yield _written(key, float(text) if bare and not declared.whole else value if bare else text), words


def _written(key: str, value: Any) -> str:
    written = value if isinstance(value, int | float) else json.dumps(value, ensure_ascii=False)
    return f"{key} = {written}"


def _aligned(text: str) -> str:
    return f"{text:<40}"
