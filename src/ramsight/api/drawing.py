"""The circuit of a unit as a drawing."""

from __future__ import annotations

from pathlib import Path

from ramsight.api.arguments import path_argument
from ramsight.argument_kinds import by_kind
from ramsight.drawing import drawn, svg
from ramsight.drawing.notes import notes
from ramsight.errors import one_line
from ramsight.machine import load_machine, only_unit
from ramsight.machine.description import Machine, Unit
from ramsight.optional import check_extra
from ramsight.output import atomic_path, check_apart, check_target
from ramsight.output.atomic import suffix_of
from ramsight.plant.build import AnyUnit, build

FILES = (".svg", ".png", ".pdf")


@by_kind
def draw(machine: AnyUnit, path: str | Path | None = None, *, unit: str | None = None, title: str | None = None) -> str:
    """Draw a unit's circuit with the symbols of ISO 1219-1, laid out from its parts and nodes.

    Whatever the circuit: from the catalogue, from a description in full, or built in Python. Groups of the SVG have the
    id ``part-NAME``, lines of a node the attribute ``data-node``, for those who want to colour it.

    Args:
        machine: a machine, its name or file; or one unit's description, or a built unit.
        path: also write it here: .svg, .png or .pdf.
        unit: name of the unit; may be left out where there is only one.
        title: above the drawing; by default the machine's name and the unit's.

    Returns:
        The drawing as SVG text.

    Raises:
        DescriptionError: several units, and none is named; or a part names no nodes.
        UnknownNameError: no such machine or unit.
        OutputError: the file cannot be written.

    Example:
        >>> import ramsight
        >>> text = ramsight.draw("press")
        >>> 'id="part-pump_a"' in text and 'data-node="port_a"' in text
        True
    """
    file = None if path is None else path_argument(path, "path")
    check_target(file, FILES)
    if file is not None and file.suffix != ".svg":
        check_extra("figures")
    if file is not None and isinstance(machine, str | Path):
        check_apart({"the machine": machine}, {"the drawing": file})
    described, name = _described(machine, unit)
    built = build(machine, unit)
    sheet = drawn(built, one_line(title or "") or name or built.name, {} if described is None else notes(described))
    text = svg.text(sheet)
    if file is not None:
        with atomic_path(file) as draft:
            if suffix_of(file, FILES) == ".svg":
                draft.write_text(text, encoding="utf-8", newline="\n")
            else:
                from ramsight.drawing import raster

                raster.save(sheet, draft)
    return text


def _described(machine: AnyUnit, unit: str | None) -> tuple[Unit | None, str | None]:
    """The unit's description, if there is one, and what stands above its drawing."""
    if isinstance(machine, str | Path | Machine):
        whole = load_machine(machine)
        name = only_unit(whole) if unit is None else unit
        return whole.unit(name), f"{whole.name}: {name}"
    return (machine, unit) if isinstance(machine, Unit) else (None, None)
