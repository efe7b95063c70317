"""A description in a notebook: the sizes that one asks for first, and the circuit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from ramsight.circuit_picture import circuit_picture
from ramsight.machine.parts import Cylinder, Drive, Oil
from ramsight.output.notebook import card
from ramsight.units import format_si


class Sized(Protocol):
    """A unit's description."""

    @property
    def circuit(self) -> str: ...  # noqa: D102
    @property
    def cylinder(self) -> Cylinder: ...  # noqa: D102
    @property
    def drive(self) -> Drive: ...  # noqa: D102
    @property
    def oil(self) -> Oil: ...  # noqa: D102


def machine_html(title: str, description: str, units: Mapping[str, Sized]) -> str:
    """A machine as HTML: its units in a table, and the circuit of the first one.

    Args:
        description: of it, "" for none.
        units: of it, by name.
    """
    rows = [(name, ", ".join(f"{key} {value}" for key, value in _sizes(unit))) for name, unit in units.items()]
    if description:
        rows.insert(0, ("", description))
    name, first = next(iter(units.items()))
    return card(title, rows, circuit_picture(first, name))


def unit_html(unit: Sized) -> str:
    """A unit's description as HTML."""
    return card(f"unit with the circuit {unit.circuit}", _sizes(unit), circuit_picture(unit, "unit"))


def _sizes(unit: Sized) -> list[tuple[str, str]]:
    cylinder, drive = unit.cylinder, unit.drive
    lengths = " / ".join(f"{1e3 * value:.4g}" for value in (cylinder.bore, cylinder.rod, cylinder.stroke))
    number = f"{cylinder.number} × " if cylinder.number > 1 else ""
    speed = format_si(drive.max_speed, "rpm", 4)
    return [
        ("circuit", unit.circuit),
        ("cylinder", f"{number}{lengths} mm (bore / rod / stroke)"),
        ("motor", f"up to {drive.max_torque:.4g} N m, {speed}"),
        ("oil", unit.oil.model or "described by its values"),
    ]
