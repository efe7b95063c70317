"""What is generated from the declarations: a template with all keys, a description of what is needed, a JSON Schema."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping
from typing import Any, Literal, get_origin

from pydantic.fields import FieldInfo

from ramsight.errors import UnknownNameError
from ramsight.machine import catalogue
from ramsight.machine.assumption_description import Assumptions
from ramsight.machine.base import Part, declared_items, part_class
from ramsight.machine.declare import Quantity, declaration, explain
from ramsight.machine.description import Composed, DirectDriven, Machine, Unit, circuits
from ramsight.machine.linkage import Linkage
from ramsight.machine.placed import PLACED
from ramsight.machine.reading import load_machine
from ramsight.machine.tolerances import EXAMPLES, KINDS, Tolerances

_WIDTH = 118
_PAIR = {"leakage-displacement": 0.5}
_FIRST = ("kind", "inlet", "outlet", "pilot", "node")  # what states where a part is stands before its values
_HEAD = """\
Machine description for ramsight. Check it with: ramsight check FILE

A meaning that begins with "yours:" is of a key that no default and no catalogue entry gives, or of the entry that gives
it: it has to be your machine's. What stands there is an example's. Of the other keys write what you know better.

Write every value with its unit; any unit of the right kind will do (mm, in, bar, MPa, l/min, rpm).
Beside each value stand its meaning and the allowed range. A value may carry its source:

    bore = { value = "127 mm", source = "drawing 4711" }

and its tolerance, "127 mm ± 0.1 mm", which `ramsight datasheet` draws machines from.

A part that names a model takes from the catalogue (ramsight catalog) what is commented out here.
Write a value to override the catalogue's, or drop the model and write them all.
What a sensor assumes is commented out too, with its defaults: write what you know better.
So are tolerances of whole kinds, with an example each, not a default."""


def template(like: Machine | None = None, name: str = "my-machine") -> str:
    """Write a commented description that is complete and valid.

    Args:
        like: the machine whose values stand in it; the catalogue's mining loader, boom only, if omitted.
        name: the name of the new machine.

    Returns:
        TOML text.

    Example:
        >>> from ramsight import machine
        >>> machine.loads(machine.template()).name
        'my-machine'
    """
    if like is None:
        from ramsight.machine.reading import load_machine

        boom = load_machine("mining-loader").units["boom"]
        like = Machine(name=name, title="My machine", description="", units={"boom": boom})
    lines = [_comment(_HEAD), ""]
    for key in ("format", "name", "title", "description"):
        field = Machine.model_fields[key]
        value = name if key == "name" else getattr(like, key)
        lines.append(_line(key, value, explain(field)))
    for unit_name, unit in like.units.items():
        lines += _unit_lines(unit_name, unit)
    if like.linkage is not None:
        lines += _linkage_lines(like.linkage)
    return "\n".join(lines) + "\n"


def _unit_lines(name: str, unit: Unit) -> list[str]:
    tables = [(key, value, "") for key, value in unit if isinstance(value, Part)]
    if isinstance(unit, Composed):
        tables += [(f"parts.{key}", part, _first_sentence(part)) for key, part in unit.parts.items()]
    lines = ["", _comment(_first_sentence(unit)), f"[units.{name}]"]
    for key, field in type(unit).model_fields.items():
        value = getattr(unit, key)
        if value is not None and not isinstance(value, Part | dict):
            lines.append(_line(key, value, yours(type(unit), key, {}) + _with_choices(field)))
    for key, part, stated in tables:
        if not isinstance(part, Assumptions | Tolerances):
            about = stated or type(unit).model_fields[key].description or _first_sentence(part)
            lines += ["", _comment(about), f"[units.{name}.{key}]", *_part_lines(part)]
    for key, field in type(unit).model_fields.items():
        if getattr(unit, key) is None and part_class(field.annotation) is not None:
            lines += ["", _comment(field.description or ""), f"# [units.{name}.{key}]"]
    for key, part in unit.assumptions:
        lines += ["", _comment(_first_sentence(part)), f"[units.{name}.assumptions.{key}]"]
        lines += _part_lines(part, defaults_off=True)
    return [*lines, *_tolerance_lines(name, unit.tolerances)]


def _tolerance_lines(name: str, stated: Tolerances) -> list[str]:
    lines = ["", _comment(_first_sentence(stated)), f"[units.{name}.tolerances]"]
    for key, field in Tolerances.model_fields.items():
        text = getattr(stated, key)
        if key in KINDS:
            words = f"{explain(field)}; {KINDS[key].range}"
            lines.append(_line(key, text or EXAMPLES[KINDS[key].unit], words, off=text is None))
        else:
            pairs = ", ".join(f"{pair} = {value:g}" for pair, value in (text or _PAIR).items())
            lines += [_comment(explain(field)), f"{'' if text else '# '}{key} = {{ {pairs} }}"]
    return lines


def _linkage_lines(linkage: Linkage) -> list[str]:
    tables: list[tuple[str, Part]] = [("", linkage)]
    tables += [(f".bodies.{name}", body) for name, body in linkage.bodies.items()]
    tables += [(f".cylinders.{name}", cylinder) for name, cylinder in linkage.cylinders.items()]
    tables += [(f".{key}", spot) for key in ("payload", "tip") if (spot := getattr(linkage, key)) is not None]
    tables += [(f".points.{name}", point) for name, point in linkage.points.items()]
    tables += [(".load_chart", linkage.load_chart)] if linkage.load_chart is not None else []
    lines = []
    for path, part in tables:
        lines += ["", _comment(_first_sentence(part)), f"[linkage{path}]"]
        for key, field in type(part).model_fields.items():
            value, inner = getattr(part, key), isinstance(getattr(part, key), Part)
            if value is None or isinstance(value, dict) or (part is linkage and inner):
                continue
            if inner:
                lines += [f"# {explain(field) or _first_sentence(value)}", f"{key} = {_inline(value)}"]
            elif isinstance(value, tuple) and (items := declared_items(field)) is not None:
                shown = json.dumps([items.show(one) for one in value], ensure_ascii=False)
                lines += [_comment(f"{explain(field)}; {items.range}"), f"{key} = {shown}"]
            else:
                declared = declaration(field)
                words = explain(field) + (f"; {declared.range}" if declared and declared.range else "")
                lines.append(_line(key, value if declared is None else _written(declared, value), words))
    return lines


def _inline(part: Part) -> str:
    """A part in one line, as TOML's inline table."""
    words = []
    for key, field in type(part).model_fields.items():
        value, declared = getattr(part, key), declaration(field)
        if isinstance(value, Part):
            words.append(f"{key} = {_inline(value)}")
        elif value is not None:
            text = value if declared is None else _written(declared, value)
            words.append(f"{key} = {text if isinstance(text, float) else json.dumps(text)}")
    return f"{{ {', '.join(words)} }}"


def _with_choices(field: FieldInfo) -> str:
    choices = getattr(field.annotation, "__args__", ()) if get_origin(field.annotation) is Literal else ()
    words = " or ".join(f'"{item}"' for item in choices)
    return "; ".join(text for text in (explain(field), words) if text)


def _part_lines(part: Part, *, defaults_off: bool = False) -> list[str]:
    model = getattr(part, "model", None)
    stated: dict[str, Any] = {}
    if model is not None:
        stated, _ = catalogue.read(catalogue.find(part.family, model))
    lines = []
    fields = sorted(type(part).model_fields.items(), key=lambda item: item[0] not in _FIRST)
    for key, field in fields:
        value, declared = getattr(part, key), declaration(field)
        if value is None:
            continue
        words = explain(field)
        if declared is not None:
            words = yours(type(part), key, stated) + words + (f"; {declared.range}" if declared.range else "")
            same = key in stated and declared.read(stated[key], from_file=True) == value
            same = same or (defaults_off and key not in part.model_fields_set)
            lines.append(_line(key, _written(declared, value), words, off=same))
        elif isinstance(value, dict):
            inner = ", ".join(f'{name} = "{item / 1e3:g} kN"' for name, item in value.items())
            lines += [f"# {words}", f"{key} = {{ {inner} }}"]
        else:
            lines.append(_line(key, value, yours(type(part), key, stated) + _with_choices(field)))
    return lines


def yours(part: type[Part], key: str, stated: Mapping[str, Any]) -> str:
    """The mark before the meaning of a key that a description has to have; "" for any other.

    Args:
        part: the class that has it.
        key: its name.
        stated: what a catalogue entry gives; then the entry's name has to be there.
    """
    chosen = {*_FIRST, "circuit"}  # what the machine is, and no value of it
    needed = {name for name, field in part.model_fields.items() if field.is_required()} - chosen
    has_to = bool(needed & stated.keys()) if key == "model" else key in needed - stated.keys()
    return "yours: " if has_to else ""


def _written(declared: Quantity, value: float) -> str | float:
    text = declared.show(value)
    if declared.whole:
        return value
    return float(text) if declared.unit == "1" and "/" not in text else text


def _line(key: str, value: Any, words: str, *, off: bool = False) -> str:
    written = value if isinstance(value, int | float) else json.dumps(value, ensure_ascii=False)
    start = f"{'# ' if off else ''}{key} = {written}"
    if len(f"{start:<40}  # {words}") <= _WIDTH:
        return f"{start:<40}  # {words}"
    return f"{_comment(words)}\n{start}"


def _comment(text: str) -> str:
    wrapped = (textwrap.wrap(line, _WIDTH - 2, drop_whitespace=False) or [""] for line in text.splitlines())
    return "\n".join(f"# {line}".rstrip() for lines in wrapped for line in lines)


def _first_sentence(part: Part) -> str:
    return (type(part).__doc__ or "").strip().splitlines()[0]


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a description, for editors that complete and check TOML.

    Example:
        >>> from ramsight import machine
        >>> machine.json_schema()["$defs"]["Cylinder"]["properties"]["bore"]["x-unit"]
        'mm'
    """
    schema = Machine.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["required"] = ["format", *schema["required"]]
    parts = schema["$defs"]["Composed"]["properties"]["parts"]["additionalProperties"]
    parts["anyOf"] = parts.pop("oneOf")  # a circuit of the catalogue gives kind and nodes, so they may be missing
    for placed in PLACED:
        definition = schema["$defs"][placed.__name__]
        definition["required"] = [key for key in definition["required"] if key not in _FIRST]
    for definition in schema["$defs"].values():
        if "model" in definition.get("properties", {}):
            _allow_model(definition)
    for unit in (DirectDriven, Composed):
        properties = schema["$defs"][unit.__name__]["properties"]
        for key, field in properties.items():
            part = part_class(unit.model_fields[key].annotation)
            if part is not None and part.family:
                names = [entry.name for entry in catalogue.entries() if entry.kind == part.family]
                properties[key] = {"anyOf": [field, {"enum": names}]} if names else field
    return schema


def _allow_model(definition: dict[str, Any]) -> None:
    """A part with a model need not give what the catalogue may give."""
    required = definition.pop("required", [])
    definition["anyOf"] = [{"required": ["model"]}, {"required": required}]


_NEEDED_HEAD = """\
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
    head = _NEEDED_HEAD.format(name=name, of=machine.title or machine.name, like=machine.name)
    lines = [head, "format = 1", f"name = {json.dumps(name)}"]
    for unit_name, unit in machine.units.items():
        lines += ["", f"[units.{unit_name}]", *_unit(unit, f"units.{unit_name}")]
    return "\n".join(lines) + "\n"


def _unit(unit: Unit, path: str) -> Iterator[str]:
    """Lines of a unit: its words and small parts as keys of its own, then a table for each larger part."""
    fields = type(unit).model_fields
    for key in ("circuit", "load_direction"):
        words = yours(type(unit), key, {}) + explain(fields[key])
        yield f"{_aligned(_needed_text(key, getattr(unit, key)))}  # {words}"
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
            yield _needed_text(key, value), yours(type(part), key, stated) + explain(field)
        elif key not in stated or declared.read(stated[key], from_file=True) != value:
            text = declared.show(value)
            words = yours(type(part), key, stated) + explain(field)
            bare = declared.whole or (declared.unit == "1" and "/" not in text)
            yield _needed_text(key, float(text) if bare and not declared.whole else value if bare else text), words


def _needed_text(key: str, value: Any) -> str:
    written = value if isinstance(value, int | float) else json.dumps(value, ensure_ascii=False)
    return f"{key} = {written}"


def _aligned(text: str) -> str:
    return f"{text:<40}"
