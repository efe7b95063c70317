"""Whether entries of one's own catalogue can be used, and what is missing of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ramsight.errors import RamsightError
from ramsight.machine import catalogue
from ramsight.machine.declare import declaration
from ramsight.machine.parts import PARTS
from ramsight.machine.reading import load_machine


@dataclass(frozen=True)
class Checked:
    """An entry that was checked."""

    path: Path
    what: str  # its kind and name; "" if it has none
    errors: tuple[str, ...] = ()  # why it cannot be used, a line each
    cautions: tuple[str, ...] = ()  # what is missing or worth a second look, a line each


def check_own() -> list[Checked]:
    """Check the entries of one's own folder, each by itself.

    Raises:
        DescriptionError: ``RAMSIGHT_CATALOG`` names what is no folder.
    """
    return [_checked(path) for path in catalogue.own_files()]


def _checked(path: Path) -> Checked:
    try:
        entry = catalogue.read_entry(path)
        if entry.kind == "machine":
            load_machine(path)
            return Checked(path, f"machine {entry.name}")
        if entry.kind not in PARTS:
            kinds = ", ".join(("machine", *PARTS))
            return Checked(path, entry.name, (f"{path}: kind = {entry.kind!r}: unknown (allowed: {kinds})",))
        errors = tuple(f"{path}: {text}" for text in _wrong(entry))
        return Checked(path, f"{entry.kind} {entry.name}", errors, tuple(_missing(entry)) if not errors else ())
    except RamsightError as error:
        return Checked(path, "", tuple(str(one) for one in (error, *getattr(error, "others", ()))))


def _wrong(entry: catalogue.Entry) -> Iterator[str]:
    """Values that no part of this kind has, or that cannot be."""
    table = catalogue.read_toml(entry.path).get("values")
    if not isinstance(table, dict) or not table:
        yield "values: is missing; a table [values] with the part's keys"
        return
    values, _ = catalogue.read(entry)
    fields = PARTS[entry.kind].model_fields
    for key, value in values.items():
        if key not in fields or key == "model":
            known = ", ".join(name for name in fields if name != "model")
            yield f"values.{key}: unknown key (allowed: {known})"
            continue
        declared = declaration(fields[key])
        if declared is None:
            continue
        try:
            declared.read(value, from_file=True)
        except RamsightError as error:
            yield f"values.{key}: {error}"


def _missing(entry: catalogue.Entry) -> Iterator[str]:
    """Values that a description has to add, and sources that are not stated."""
    values, sources = catalogue.read(entry)
    needed = [key for key, field in PARTS[entry.kind].model_fields.items() if field.is_required() and key not in values]
    if needed:
        yield f"left to the description: {', '.join(needed)}"
    unsourced = [key for key in values if not sources[key]]
    if unsourced:
        yield f"without a source: {', '.join(unsourced)}"
    if not entry.description:
        yield "without a description"
