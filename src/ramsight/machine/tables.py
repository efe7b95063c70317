"""Descriptions and what follows from them, as tables for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ramsight.machine import catalogue
from ramsight.machine.base import walk
from ramsight.machine.declare import declaration, explain
from ramsight.machine.parts import PARTS
from ramsight.machine.placed import KINDS
from ramsight.machine.reading import load_machine


def table_of(headings: tuple[str, ...]) -> Table:
    """An empty table with these headings; where it is wider than the terminal, cells wrap between words."""
    table = Table(box=None, pad_edge=False)
    table.show_header = any(headings)
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="right" if number and heading else "left", overflow="fold")
    return table


def catalogue_list() -> Table:
    """Everything in the catalogue, each kind below its name."""
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column()
    last = ""
    for entry in catalogue.entries():
        if entry.kind != last:
            table.add_row(Text(entry.kind, style="bold"), "")
        table.add_row(
            Text(f"  {entry.name}"),
            Text(f"{entry.description} (own: {entry.path.name})" if entry.is_own else entry.description),
        )
        last = entry.kind
    return table


def rows_of(rows: Iterable[tuple[str, ...]]) -> Table:
    """A table without headings, of which the last column alone wraps."""
    table, cells = Table(box=None, pad_edge=False, show_header=False), [*rows]
    for number in range(len(cells[0])):
        table.add_column(no_wrap=number < len(cells[0]) - 1)
    for row in cells:
        table.add_row(*(Text(cell) for cell in row))
    return table


def catalogue_entry(name: str) -> RenderableType:
    """Every value of a catalogue entry, with what it is and where it comes from.

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
    if drawing := catalogue.drawing(entry):
        parts += [Text(), Text(drawing)]
    for place, table in tables.items():
        parts += [Text(), Text(f"[{place}]", style="bold"), table] if place else [Text(), table]
    return Group(*parts)


def _rows(entry: catalogue.Entry) -> Iterator[tuple[str, str, str, str]]:
    if entry.kind == "machine":
        machine = load_machine(entry.name)
        found = [value for name, unit in machine.units.items() for value in walk(unit, f"units.{name}.")]
        if machine.linkage is not None:
            found += walk(machine.linkage, "linkage.")
        for value in found:
            source = machine.source_of(value.path) or ""
            yield value.path, value.shown, value.text, source if value.given else "default"
        return
    if entry.kind == "circuit":
        for part, places in catalogue.circuit(entry.name).items():
            for key, value in places.items():
                yield f"parts.{part}.{key}", str(value), explain(KINDS[places["kind"]].model_fields[key]), entry.source
        return
    values, sources = catalogue.read(entry)
    fields = PARTS[entry.kind].model_fields
    for key, value in values.items():
        declared = declaration(fields[key])
        shown = declared.show(declared.read(value, from_file=True)) if declared else str(value)
        yield key, shown, explain(fields[key]), sources[key]
