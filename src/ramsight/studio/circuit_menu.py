"""A machine's circuits as a menu of its description: each part of a drawing leads to the values that describe it."""

from __future__ import annotations

from collections.abc import Collection
from html import escape

from ramsight.drawing import drawn, svg
from ramsight.drawing.notes import BOTH_SIDES
from ramsight.machine.description import Machine
from ramsight.plant.build import build

_SENSORS = {"oil temperature": "assumptions.thermometer", "pressure_a": "assumptions.pressure",
            "pressure_b": "assumptions.pressure"}  # fmt: skip


def section_of(unit: str, part: str, groups: Collection[str]) -> str | None:
    """The table of a description that describes a part of a circuit; None if there is none.

    Args:
        unit: name of the unit.
        part: as its drawing names it.
        groups: tables that the description has, dotted.

    Example:
        >>> groups = ["units.boom", "units.boom.relief_valve", "units.boom.pump_a", "units.boom.hose"]
        >>> [section_of("boom", part, groups) for part in ("pump_a", "relief_b", "hose_a", "load")]
        ['units.boom.pump_a', 'units.boom.relief_valve', 'units.boom.hose', None]
    """
    stem = part.removesuffix("_a").removesuffix("_b")
    names = (_SENSORS.get(part, part), f"parts.{part}", stem, BOTH_SIDES.get(stem, stem))
    return next((found for one in names if (found := f"units.{unit}.{one}") in groups), None)


def circuit_menu(machine: Machine, groups: Collection[str]) -> str:
    """The circuits of all units as HTML, each part a button with `data-section`.

    Args:
        machine: whose circuits they are.
        groups: tables that its description has, dotted.

    Raises:
        RamsightError: a unit cannot be built or drawn.
    """
    parts: list[str] = []
    for name, unit in machine.units.items():
        sheet = drawn(build(unit, name), f"circuit of {name}")
        found = {placed.name: section_of(name, placed.name, groups) for placed in sheet.placed}
        sections = {part: section for part, section in found.items() if section is not None}
        head = f"<h3>{escape(name)}</h3>" if len(machine.units) > 1 else ""
        parts.append(head + svg.text(sheet, sections))
    return "".join(parts)
