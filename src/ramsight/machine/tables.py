"""Descriptions and what follows from them, as tables for a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from ramsight.machine import catalogue
from ramsight.machine.declare import declaration, explain, walk
from ramsight.machine.derived import cautions, derive, torque_at_load
from ramsight.machine.description import Machine, Unit
from ramsight.machine.parts import PARTS
from ramsight.machine.reading import load
from ramsight.units import format_si

_SPEED, _TEMPERATURE = 50 * math.pi, 313.15  # 1500 rpm and 40 °C
_WIDE = 140  # columns where the output goes into a file or a pipe


def show(what: RenderableType) -> None:
    """Print a table on standard output.

    Args:
        what: the table.
    """
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = _WIDE
    console.print(what)


def machine_summary(machine: Machine, only: str | None = None) -> RenderableType:
    """Tables of what follows from a description, a unit at a time.

    Args:
        machine: the machine.
        only: name of the one unit to show; all if not given.

    Raises:
        UnknownNameError: there is no such unit.
    """
    names = [only] if only is not None else list(machine.units)
    parts: list[RenderableType] = [Text(machine.title or machine.name, style="bold")]
    for name in names:
        unit = machine.unit(name)
        parts += [Text(), _facts(name, unit)]
        if unit.load.loads:
            parts += [Text(), _loads(unit)]
        parts += [Text(f"look twice: {sentence}", style="yellow") for sentence in cautions(unit)]
    return Group(*parts)


def _table(headings: tuple[str, ...]) -> Table:
    table = Table(box=None, pad_edge=False)
    table.show_header = any(headings)
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="right" if number and heading else "left", no_wrap=True)
    return table


def _facts(name: str, unit: Unit) -> Group:
    found = derive(unit)
    side = unit.load_side.upper()
    title = f"unit {name}: lifts by {unit.load_direction}ing, side {side} holds the load"
    table = _table(("", ""))
    pumped = (_per_rev(found.geared_displacement_a, 1e6), _per_rev(found.geared_displacement_b, 1e6))
    travel = (_per_rev(found.travel_a, 1e3), _per_rev(found.travel_b, 1e3))
    flow = f"{found.geared_flow_ratio:.3f}, {found.mismatch:+.1%} off the area ratio"
    table.add_row("areas A, B", f"{found.area_a * 1e6:.0f}, {found.area_b * 1e6:.0f} mm2")
    table.add_row("area ratio B/A", f"{found.area_ratio:.3f}")
    table.add_row("geared flow ratio B/A", flow)
    table.add_row("pumped per motor rev A, B", f"{pumped[0]:.2f}, {pumped[1]:.2f} cm3")
    table.add_row("travel without leakage A, B", f"{travel[0]:.3f}, {travel[1]:.3f} mm per motor rev")
    table.add_row("load at relief pressure", f"{found.load_at_relief / 1e3:.1f} kN")
    table.add_row("  less breakaway friction", f"{found.load_at_relief_after_friction / 1e3:.1f} kN")
    return Group(Text(title, style="bold"), table)


def _per_rev(per_radian: float, scale: float) -> float:
    return per_radian * 2 * math.pi * scale


def _loads(unit: Unit) -> Group:
    conditions = f"{format_si(_SPEED, 'rpm', 6)}, {format_si(_TEMPERATURE, 'degC', 4)}"
    title = f"steady lift / lower at {conditions}, other side at tank pressure"
    table = _table(("load", "kN", "chamber bar", "motor N m", "mm per motor rev"))
    for name, force in unit.load.loads.items():
        point = torque_at_load(unit, force, _TEMPERATURE, _SPEED)
        table.add_row(
            Text(name),
            f"{force / 1e3:g}",
            f"{point.pressure_lift / 1e5:.1f} / {point.pressure_lower / 1e5:.1f}",
            f"{point.torque_lift:+.1f} / {point.torque_lower:+.1f}",
            f"{_per_rev(point.travel_lift, 1e3):.3f} / {_per_rev(point.travel_lower, 1e3):.3f}",
        )
    return Group(Text(title, style="bold"), table)


def catalogue_list() -> Table:
    """Everything in the catalogue, by kind."""
    table = Table(box=None, pad_edge=False)
    for heading in ("kind", "name", "description"):
        table.add_column(heading, no_wrap=heading != "description")
    last = ""
    for entry in catalogue.entries():
        table.add_row(entry.kind if entry.kind != last else "", entry.name, entry.description)
        last = entry.kind
    return table


def catalogue_entry(name: str) -> RenderableType:
    """Every value of a catalogue entry, with what it is and where it comes from.

    Args:
        name: name of the entry.

    Raises:
        UnknownNameError: the catalogue has no such name.
    """
    entry = catalogue.find("", name)
    tables: dict[str, Table] = {}
    for path, *cells in _rows(entry):
        place, _, key = path.rpartition(".")
        if place not in tables:
            tables[place] = Table(box=None, pad_edge=False, expand=True)
            tables[place].add_column("key", min_width=26, overflow="fold")
            tables[place].add_column("value", min_width=13, overflow="fold")
            tables[place].add_column("meaning", ratio=1, overflow="fold")
            tables[place].add_column("source", ratio=1, overflow="fold")
        tables[place].add_row(*(Text(cell) for cell in (key, *cells)))
    title = Text(f"{entry.kind} {entry.name}: {entry.description}", style="bold")
    parts: list[RenderableType] = [title]
    for place, table in tables.items():
        parts += [Text(), Text(f"[{place}]", style="bold"), table] if place else [Text(), table]
    return Group(*parts)


def _rows(entry: catalogue.Entry) -> Iterator[tuple[str, str, str, str]]:
    if entry.kind == "machine":
        machine = load(entry.name)
        for value in (
            value for name, unit in machine.units.items() for value in walk(unit, f"units.{name}.")
        ):
            yield value.path, value.shown, value.text, machine.source_of(value.path) or ""
        return
    values, sources = catalogue.read(entry)
    fields = PARTS[entry.kind].model_fields
    for key, value in values.items():
        declared = declaration(fields[key])
        shown = declared.show(declared.read(value, from_file=True)) if declared else str(value)
        yield key, shown, explain(fields[key]), sources[key]
