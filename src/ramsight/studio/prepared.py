"""What all pages of a machine that runs share: its drawing, the lines in which its oil moves, its mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ramsight.drawing import Sheet, drawn, svg
from ramsight.drawing.flowing import chains
from ramsight.drawing.notes import notes
from ramsight.machine.description import Machine
from ramsight.plant.build import build
from ramsight.plant.linked import LinkedMachine, build_linked
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit


@dataclass(frozen=True)
class Prepared:
    """What all pages of a machine share, made once."""

    described: Machine
    linked: LinkedMachine | None  # its mechanism, if it has one
    circuits: Mapping[str, str]  # the drawing of each unit that runs, as SVG
    lines: Mapping[str, Any]  # of each of them, what the page needs to let the oil in its lines move


def prepare(described: Machine) -> Prepared:
    """Make what all pages of a machine share.

    Raises:
        RamsightError: what is described cannot be built or drawn.
    """
    units = list(described.units) if described.linkage is not None else list(described.units)[:1]
    circuits, lines = {}, {}
    for name in units:
        unit = described.unit(name)
        built = build(unit, name)
        sheet = drawn(built, f"{described.name}: {name}", notes(unit))
        circuits[name], lines[name] = svg.text(sheet), _lines(sheet, built)
    linked = None if described.linkage is None else build_linked(described)
    return Prepared(described, linked, circuits, lines)


def _lines(sheet: Sheet, unit: HydraulicUnit) -> dict[str, Any]:
    """Lines with the flows that pass them, and what the largest pump delivers at the highest speed [l/min]."""
    pumps = [part.displacement for part in unit.parts() if isinstance(part, Pump)]
    return {
        "full": round(60e3 * max(pumps, default=1e-5) * unit.max_speed, 1),
        "chains": [{"points": chain.points, "flows": chain.flows} for chain in chains(sheet, unit)],
    }
