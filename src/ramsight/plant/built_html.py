"""A built unit as it is shown: a line of text, and a card in a notebook."""

from __future__ import annotations

import math

from ramsight.circuit_picture import circuit_picture
from ramsight.output.notebook import card
from ramsight.plant.unit import HydraulicUnit
from ramsight.units import format_si


def built_line(unit: HydraulicUnit) -> str:
    """A built unit in a line: its sizes."""
    return f"unit {unit.name}: {', '.join(f'{name} {value}' for name, value in _sizes(unit))}"


def built_html(unit: HydraulicUnit) -> str:
    """A built unit as HTML: its sizes, and its circuit.

    Args:
        unit: the unit.
    """
    rows = [*_sizes(unit), ("parts", ", ".join(part.name for part in unit.parts()))]
    return card(f"unit {unit.name}", rows, circuit_picture(unit, unit.name))


def _sizes(unit: HydraulicUnit) -> list[tuple[str, str]]:
    cylinder = unit.cylinder
    return [
        ("areas A, B", f"{1e6 * cylinder.area_a:.0f}, {1e6 * cylinder.area_b:.0f} mm2"),
        ("stroke", format_si(cylinder.stroke, "mm", 4)),
        ("travel of a motor turn", f"{1e3 * unit.travel_per_radian * math.tau:.4g} mm"),
        ("motor", f"up to {format_si(unit.max_speed, 'rpm', 4)}"),
        ("oil", unit.oil.name),
    ]
