"""Every figure, table, equation and statement of the paper: where it is, and how it fared."""

from __future__ import annotations

from typing import NamedTuple

from reproduction.chapter import Study, Verdict

_MACHINE, _DRAWN, _DIAGRAMS, _CYCLE, _MOVEMENT, _PUMPS = (
    "The machine: the paper's Tables 1 and 2",
    "The machine and its models, drawn (Figs 1, 2, 5 and 6)",
    "How the position is calculated (Figs 4, 7 and 8)",
    "One lift-lower cycle (Figs 11 to 16)",
    "Movement per motor revolution (Figs 9 and 10)",
    "Pump efficiencies (Fig. 3)",
)
_GOOD, _FITTED = Verdict.REPRODUCED, Verdict.FITTED


class Item(NamedTuple):
    """A line of the table.

    Attributes:
        place: in the paper.
        says: what it is, or what it says.
        where: the chapter of the report, or the command or page, that has it.
        verdict: how it fared.
    """

    place: str
    says: str
    where: str
    verdict: Verdict


DRAWN = (
    Item("Fig. 1", "the loader's arm; dimensions not given, derived from loads and strokes", _DRAWN, _FITTED),
    Item("Fig. 2", "circuit and components of the boom's unit; motor, battery, controller by name", _DRAWN, _GOOD),
    Item("Fig. 3", "efficiencies of the pumps over pressure: the shapes; values not readable", _PUMPS, _GOOD),
    Item("Fig. 4", "how the parts of the calculation act on each other: the order of the laws", _DIAGRAMS, _GOOD),
    Item("Fig. 5", "model of the boom's hydraulics: here an equation of the whole circuit", _DRAWN, _GOOD),
    Item("Fig. 6", "model of the pumps: pumps that also work as motors", _DRAWN, _GOOD),
    Item("Fig. 7", "from torque, speed and temperature to the position: the table sensor", _DIAGRAMS, _GOOD),
    Item("Fig. 8", "sensorless control of a cylinder, the loop closed (make film)", _DIAGRAMS, _GOOD),
    Item("Fig. 9", "boom, movement per revolution over torque and temperature", _MOVEMENT, _GOOD),
    Item("Fig. 10", "bucket, movement per revolution over torque and temperature", _MOVEMENT, _GOOD),
    Item("Fig. 11", "boom, position with 129 kN", _CYCLE, _FITTED),
    Item("Fig. 12", "boom, position with 441 kN", _CYCLE, _FITTED),
    Item("Fig. 13", "bucket, position with 48 kN", _CYCLE, _FITTED),
    Item("Fig. 14", "bucket, position with 162 kN", _CYCLE, _FITTED),
    Item("Fig. 15", "boom, errors at three loads", _CYCLE, _FITTED),
    Item("Fig. 16", "bucket, errors at three loads", _CYCLE, _FITTED),
    Item("Table 1", "cylinders; numbers lost, derived, each cell with its source", _MACHINE, _FITTED),
    Item("Table 2", "pumps; numbers partly lost, derived, each cell with its source", _MACHINE, _FITTED),
    Item(
        "Eq. 1",
        "force of the piston; friction of Table 1 in the place of an efficiency",
        "docs/explanation/plant-laws.md",
        _GOOD,
    ),
    Item(
        "Eq. 2", "speed of the piston by the flow; with the oil's compression", "docs/explanation/plant-laws.md", _GOOD
    ),
    Item("Eq. 3", "flow of a pump", _PUMPS, _GOOD),
    Item("Eq. 4", "torque of a pump", _PUMPS, _GOOD),
    Item("Eq. 5", "hydromechanical efficiency", _PUMPS, _GOOD),
    Item("Eq. 6", "volumetric efficiency", _PUMPS, _GOOD),
    Item("Eq. 7", "friction torque; with the absolute value that the text lost", _PUMPS, _GOOD),
    Item("Eq. 8", "friction coefficient by the nominal efficiencies", _PUMPS, _GOOD),
    Item("Eq. 9", "leakage in proportion to pressure", _PUMPS, _GOOD),
    Item("Eq. 10", "leakage coefficient by viscosity and density", _PUMPS, _GOOD),
    Item("Section 2", "oil 32 mm²/s at 40 °C; nominal point 1450 rpm, 250 bar, 46 mm²/s, 872 kg/m³", _MACHINE, _GOOD),
    Item("Section 2", "pumps of 31.6 and 63.2 cm³/rev, belts 41/47 and 28/44, no-load torque 0.5 N m", _MACHINE, _GOOD),
    Item(
        "Section 2",
        "safety valves closed while lifting, opened by the motor's speed",
        "docs/explanation/plant-laws.md",
        _GOOD,
    ),
    Item("Section 3", "cycles: the motor at constant speed for a fixed time, up and down", _CYCLE, _GOOD),
)
"""What the paper draws, tabulates and writes as equations. Laws are tested one by one; a figure has its chapter."""
_DECIDED_BY = {"Fig. 3": "Fig. 3", "Fig. 9": "Figs 9, 10", "Fig. 10": "Figs 9, 10"} | {
    f"Fig. {number}": "Conclusion" for number in range(11, 17)
}
"""Figures with curves, and the place of the statements in their chapter that say whether they came out."""
_ORDER = ("Abstract", "Introduction", "Section 1", "Section 2", "Table", "Fig", "Eq", "Section 3", "Discussion")


def drawn(study: Study) -> list[Item]:
    """The lines of what is drawn; a figure with curves is contradicted if a statement on it is.

    Args:
        study: the study that decided the statements.
    """
    against = {
        (chapter.title, statement.place)
        for chapter in study.chapters
        for statement in chapter.statements
        if statement.verdict is Verdict.CONTRADICTED
    }
    return [
        item._replace(verdict=Verdict.CONTRADICTED) if (item.where, _DECIDED_BY.get(item.place)) in against else item
        for item in DRAWN
    ]


def coverage(study: Study) -> list[Item]:
    """Every line, what is drawn first, then the statements in the paper's order.

    Args:
        study: the study that decided the statements.
    """
    said = [
        Item(statement.place, statement.paper, chapter.title, statement.verdict)
        for chapter in study.chapters
        for statement in chapter.statements
    ]
    return [*drawn(study), *sorted(said, key=lambda item: _rank(item.place))]


def _rank(place: str) -> int:
    return next((k for k, name in enumerate(_ORDER) if place.startswith(name)), len(_ORDER))


def coverage_rows(study: Study) -> list[tuple[str, str, str, str]]:
    """The lines of the table of coverage, as text."""
    return [(item.place, item.says, item.where, item.verdict.value) for item in coverage(study)]
