"""From a TOML file to checked parts: sources set aside, catalogue names resolved, one line per mistake."""

from __future__ import annotations

import re
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.machine import catalogue
from ramsight.machine.declare import FROM_FILE, Part, declaration, explain
from ramsight.machine.description import FORMAT, IN_FULL, Composed, DirectDriven, Machine, circuits
from ramsight.machine.placed import KINDS
from ramsight.units import name_of

P = TypeVar("P", bound=Part)

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


def load(name_or_path: str | Path) -> Machine:
    """Read a machine, by its name in the catalogue or from a file.

    Args:
        name_or_path: a catalogue name such as ``"mining-loader"``, or the path of a TOML description.

    Returns:
        The machine, checked, in SI units.

    Raises:
        DescriptionError: the file cannot be read or holds something that cannot be used; one line that names
            file, key, value and allowed range.
        UnknownNameError: no such machine, or the description names an unknown oil, pump or valve.

    Example:
        >>> from ramsight import machine
        >>> sorted(machine.load("mining-loader").units)
        ['boom', 'bucket']
    """
    if isinstance(name_or_path, str) and catalogue.has("machine", name_or_path):
        entry = catalogue.find("machine", name_or_path)
        return _machine(catalogue.read_toml(entry.path), entry.name)
    path = Path(name_or_path)
    looks_like_path = isinstance(name_or_path, Path) or path.suffix == ".toml" or len(path.parts) != 1
    if not looks_like_path and not path.exists():
        known = [entry.name for entry in catalogue.entries() if entry.kind == "machine"]
        raise UnknownNameError("machine file or catalogue name", str(name_or_path), known)
    return _machine(catalogue.read_toml(path), str(path))


def loads(text: str, file: str = "description") -> Machine:
    """Read a machine from the text of a description.

    Args:
        text: TOML.
        file: what to call it in errors.

    Raises:
        DescriptionError: as `load`.
        UnknownNameError: as `load`.
    """
    return _machine(catalogue.parse_toml(text, file), file)


def _machine(data: dict[str, Any], file: str) -> Machine:
    _check_format(data, file)
    plain, sources = catalogue.split_sources(data, file)
    units = plain.get("units")
    if isinstance(units, dict):
        for name, unit in units.items():
            if not _NAME.fullmatch(name):
                raise DescriptionError(
                    "a unit's name starts with a letter and holds letters, digits, - and _",
                    file=file,
                    key=f"units.{name}",
                )
            if isinstance(unit, dict):
                units[name] = _resolve(unit, f"units.{name}", sources, file)
    machine = validate(Machine, plain, file=file, context=FROM_FILE)
    machine._sources = sources
    machine._origin = file
    return machine


def _check_format(data: Mapping[str, Any], file: str) -> None:
    given = data.get("format")
    if given is None:
        raise DescriptionError(f"is missing; write format = {FORMAT}", file=file, key="format")
    if isinstance(given, int) and given > FORMAT:
        message = f"was written for a newer ramsight; this one reads up to format {FORMAT}, update it"
        raise DescriptionError(message, file=file, key="format", value=given)
    if isinstance(given, bool) or given != FORMAT:
        raise DescriptionError("is no format", file=file, key="format", value=given, allowed=str(FORMAT))


def _resolve(unit: dict[str, Any], path: str, sources: dict[str, str], file: str) -> dict[str, Any]:
    """Fill in what catalogue entries give and the description does not."""
    resolved = dict(unit)
    circuit = resolved.get("circuit", "ddh")
    composed = circuit != "ddh"
    if isinstance(circuit, str) and circuit not in (known := circuits()):
        raise DescriptionError(
            "unknown choice", file=file, key=f"{path}.circuit", value=circuit, allowed=", ".join(known)
        )
    for key, field in (Composed if composed else DirectDriven).model_fields.items():
        part = field.annotation
        if key in resolved and isinstance(part, type) and issubclass(part, Part):
            resolved[key] = _from_model(resolved[key], part.family, f"{path}.{key}", sources, file)
    if composed and isinstance(resolved.get("parts", {}), dict):
        resolved["parts"] = _parts(resolved, path, sources, file)
    return resolved


def _parts(unit: Mapping[str, Any], path: str, sources: dict[str, str], file: str) -> dict[str, Any]:
    """Fill in what the catalogue's circuit gives: kinds and nodes."""
    parts = dict(unit.get("parts", {}))
    name = unit["circuit"]
    if isinstance(name, str) and name != IN_FULL and catalogue.has("circuit", name):
        for key, template in catalogue.circuit(name).items():
            given = parts.get(key, {})
            if isinstance(given, dict):
                for item in template.keys() - given.keys():
                    sources.setdefault(f"{path}.parts.{key}.{item}", f"circuit {name}: [D] by its drawing")
                parts[key] = {**template, **given}
    for key, part in parts.items():
        kind = part.get("kind") if isinstance(part, dict) else None
        if isinstance(kind, str) and kind in KINDS:
            parts[key] = _from_model(part, KINDS[kind].family, f"{path}.parts.{key}", sources, file)
    return parts


def _from_model(given: Any, family: str, path: str, sources: dict[str, str], file: str) -> Any:
    """Fill in what the catalogue entry that a part names gives."""
    if isinstance(given, str) and family:
        given = {"model": given}
    if not family or not isinstance(given, dict) or not isinstance(given.get("model"), str):
        return given
    entry = catalogue.find(family, given["model"], where=f"{file}: {path}")
    values, origins = catalogue.read(entry)
    for name in values.keys() - given.keys():
        sources.setdefault(f"{path}.{name}", f"{entry.name}: {origins.get(name, entry.source)}")
    return {**values, **given, "model": entry.name}


def validate(
    model: type[P], data: Mapping[str, Any], *, file: str | None = None, context: Any = None, prefix: str = ""
) -> P:
    """Build a part, turning what pydantic has to say into one line.

    Args:
        model: the class to build.
        data: its values.
        file: the file they came from.
        context: `FROM_FILE` where numbers without a unit must be refused.
        prefix: path of the part in the file, for the error text.

    Raises:
        DescriptionError: the first thing that is wrong, and how many more there are.
    """
    try:
        return model.model_validate(dict(data), context=context)
    except ValidationError as error:
        problems = error.errors(include_url=False)
    # a misspelt key is both unknown and missing: the unknown one says more
    problems.sort(key=lambda problem: problem["type"] != "extra_forbidden")
    raise _one_line(model, dict(problems[0]), len(problems) - 1, file, prefix)


def _one_line(model: type[Part], problem: dict[str, Any], more: int, file: str | None, prefix: str) -> DescriptionError:
    steps = [str(item) for item in problem["loc"]]
    location = [step for step in steps if not step.startswith("@")]
    context = problem.get("ctx", {})
    value, allowed = problem["input"], context.get("allowed")
    holder, field = _field_at(model, steps)
    kind = problem["type"]
    if kind == "extra_forbidden":
        known = list(holder.model_fields) if holder else []
        close = get_close_matches(location[-1], known, n=1)
        hint = f"did you mean {close[0]!r}?" if close else f"known: {', '.join(known)}"
        message, value = f"unknown key; {hint}", None
    elif kind == "missing":
        message, value = f"is missing: {_describe(field)}", None
        if holder is not None and "model" in holder.model_fields:
            message += "; or name a model of the catalogue that has it"
    elif kind in ("quantity", "cross", "units"):
        message, value = context["text"], context.get("value")
        location += context["key"].split(".") if "key" in context else []
        if field is not None and (declared := declaration(field)) and not allowed:
            allowed = declared.range
    elif kind == "union_tag_not_found":
        given = value.get("kind") if isinstance(value, dict) else None
        message, allowed = "needs the kind of part" if given is None else "unknown choice", ", ".join(KINDS)
        if isinstance(value, dict):
            location, value = [*location, "kind"], given
        else:
            message, allowed = "expected a table of values", None
    elif kind in ("model_type", "model_attributes_type", "dict_type"):
        message = "expected a table of values"
    elif kind == "literal_error":
        message, allowed = "unknown choice", context.get("expected", "").replace("'", "")
    else:
        message = str(problem["msg"])
    if more:
        message += f" (and {more} more)"
    value = value if isinstance(value, str | int | float) else None
    return DescriptionError(message, file=file, key=prefix + ".".join(location), value=value, allowed=allowed)


def _field_at(model: type[BaseModel], location: list[str]) -> tuple[type[BaseModel] | None, Any]:
    """Follow a path through the classes: the class that holds its last key, and that key's field."""
    holder: type[BaseModel] | None = model
    field = None
    steps = list(location)
    while steps and holder is not None:
        field = holder.model_fields.get(steps.pop(0))
        if field is None or not steps:
            break
        inner: Any = field.annotation
        if any(step.startswith("@") for step in steps[:2]):  # one of several classes, by name
            while not steps[0].startswith("@"):
                steps.pop(0)
            tag = steps.pop(0)
            inner = {"@direct-driven": DirectDriven, "@composed": Composed}.get(tag) or KINDS[tag[1:]]
            if not steps:
                field = None
            holder = inner
            continue
        if getattr(inner, "__origin__", None) is dict:
            inner = inner.__args__[1]
            steps.pop(0)
            if not steps:
                field = None
        holder = inner if isinstance(inner, type) and issubclass(inner, BaseModel) else None
    return holder, field


def _describe(field: Any) -> str:
    if field is None:
        return "it has to be given"
    declared = declaration(field)
    if declared is None:
        return explain(field) or "a table of values"
    words = f"{declared.text} ({declared.range})" if declared.range else declared.text
    return f"{words}, {name_of(declared.unit)}"
