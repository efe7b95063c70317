"""Writes the tables of description-keys.md from the models of a description: python evaluation/description_keys.py."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, get_args, get_origin

import pages
from pydantic.fields import FieldInfo

from ramsight.machine.assumption_description import Assumptions
from ramsight.machine.base import Part, declared_items, part_class
from ramsight.machine.declare import declaration, explain
from ramsight.machine.description import Composed, DirectDriven, Machine, Unit
from ramsight.machine.linkage import (
    Attachment,
    Linkage,
    LinkageCylinder,
    LoadChart,
    Payload,
    Point,
    SlidingBody,
    TurningBody,
)
from ramsight.machine.placed import PLACED
from ramsight.machine.tolerances import KINDS, Tolerances

HEAD = ("| key | meaning | unit | range | default |", "|---|---|---|---|---|")
MARK = "description_keys"
LINKAGE: dict[str, type[Part]] = {
    "linkage": Linkage,
    "linkage.bodies.NAME, turning": TurningBody,
    "linkage.bodies.NAME, sliding": SlidingBody,
    "linkage.cylinders.UNIT": LinkageCylinder,
    "linkage.payload": Payload,
    "linkage.points.NAME": Attachment,
    "linkage.load_chart": LoadChart,
    "linkage.load_chart.about": Point,
}
"""Tables of a mechanism, and what holds their keys."""


def row(key: str, field: FieldInfo) -> str:
    """A key with what its declaration says."""
    declared = declaration(field) or (declared_items(field) if get_origin(field.annotation) is tuple else None)
    choices = get_args(field.annotation) if get_origin(field.annotation) is Literal else ()
    allowed = declared.range if declared else " or ".join(f"`{one}`" for one in choices)
    unit = declared.unit if declared else ""
    cells = (f"`{key}`", explain(field), "" if unit == "1" else unit, allowed, default(field))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def default(field: FieldInfo) -> str:
    """What holds where the key is left out; `required` where nothing does."""
    declared = declaration(field)
    if field.is_required():
        return "required"
    value: Any = field.get_default(call_default_factory=True)
    if value is None or value in ("", {}):
        return "–"
    return declared.show(value) if declared else f"`{value}`"


def table(part: type[Part], without: type[Part] | None = None) -> list[str]:
    """The keys of a part, each a row; tables of their own and another part's keys are left out."""
    known = () if without is None else without.model_fields
    fields = {key: field for key, field in part.model_fields.items() if key not in known}
    own = {key: field for key, field in fields.items() if part_class(field.annotation) is None}
    return [*HEAD, *(row(key, field) for key, field in own.items())] if own else []


def parts_of(holder: type[Part]) -> Iterator[tuple[str, type[Part], str]]:
    """Tables below a part: name, what holds their keys, and what they are."""
    for key, field in holder.model_fields.items():
        inner = part_class(field.annotation)
        if inner is not None:
            yield key, inner, field.description or ""


def sections() -> Iterator[tuple[str, str, list[str]]]:
    """Every table with its heading and what it is."""
    yield "The file", "Keys before any table.", table(Machine)
    yield "[units.NAME]", "A unit: a cylinder with its circuit and drive.", table(Composed)
    there: dict[type[Part], str] = {}
    for key, part, about in parts_of(Unit):
        if part not in (Assumptions, Tolerances):
            yield f"[units.NAME.{key}]", about, table(part)
    for key, part, about in parts_of(DirectDriven):
        if key not in Unit.model_fields:
            own = f'Of `circuit = "ddh"`: {about}'.rstrip(": ")
            yield f"[units.NAME.{key}]", *_beside(there, part, own)
            there.setdefault(part, f"[units.NAME.{key}]")
    parts = Composed.model_fields["parts"].description or ""
    yield "[units.NAME.parts.PART]", f"Of all other circuits: {parts}. Keys by `kind`:", []
    for placed in PLACED:
        (kind,) = get_args(placed.model_fields["kind"].annotation)
        yield f'kind = "{kind}"', *_beside(there, placed, "")
        there.setdefault(placed, f'kind = "{kind}"')
    for key, part, about in parts_of(Assumptions):
        yield f"[units.NAME.assumptions.{key}]", about, table(part)
    tolerances = [f"| `{key}` | {explain(Tolerances.model_fields[key])} | {KINDS[key].range} |" for key in KINDS]
    head = ["| key | meaning | range |", "|---|---|---|"]
    yield "[units.NAME.tolerances]", "How far a machine may be from its description.", [*head, *tolerances]
    for name, part in LINKAGE.items():
        yield f"[{name}]", "", table(part)


def _beside(there: dict[type[Part], str], part: type[Part], about: str) -> tuple[str, list[str]]:
    """What a table is and its rows, without the keys of a class that has its table already."""
    known = next((one for one in part.__mro__ if one in there), None)
    if known is None:
        return about, table(part)
    same = f"{about}; keys" if about else "Keys"
    rows = table(part, known)
    return f"{same} as of `{there[known]}`{', and:' if rows else '.'}", rows


def rows() -> list[str]:
    """All tables, each below its heading."""
    lines: list[str] = []
    for heading, about, found in sections():
        lines += [""] if lines else []
        lines += [f"### {heading}" if heading == "The file" else f"### `{heading}`"]
        lines += ["", f"{about[0].upper()}{about[1:]}"] if about else []
        lines += ["", *found] if found else []
    return lines


def main() -> None:
    """Renew the tables."""
    pages.put(pages.page_of(MARK), {MARK: rows()})


if __name__ == "__main__":
    main()
