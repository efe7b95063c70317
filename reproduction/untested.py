"""Statements of the paper that no simulation can test."""

from __future__ import annotations

from reproduction.bench import Bench
from reproduction.chapter import Chapter, Statement, Verdict

_STATEMENTS = (
    (
        "Abstract, introduction",
        "Position sensors of cylinders are accurate, but expensive and not suited for harsh environments.",
        "A simulation knows neither prices nor environments.",
    ),
    (
        "Introduction",
        "References [8] and [9] found errors of 1 to 3 % while lifting and lowering, with no regard to temperature.",
        "Measured on other machines. The table's errors of one cycle stand in % of the stroke beside those in mm.",
    ),
    (
        "Introduction",
        "Electric motors answer fast, so that cheaper pumps of fixed displacement can be used.",
        "A comparison of machines that are not described.",
    ),
    (
        "Section 2",
        "The largest lifting forces of both units (numbers lost in the text).",
        "The numbers are lost; they follow here from the loads and are part of the machine's description.",
    ),
    (
        "Section 3",
        "40 °C is in the range of the most common running temperatures of hydraulic oil.",
        "The range is lost in the text; cycles at 20, 40 and 60 °C are shown.",
    ),
    (
        "Discussion",
        "Direct driven hydraulics need more components and expenses; multi-pump systems need more pump units.",
        "A matter of prices and of machines that are not described.",
    ),
    (
        "Discussion",
        "It is easier to make a unit sensorless that is designed from scratch, with all parameters known.",
        "A matter of work, not of simulation. What unknown parameters cost stands in the chapters on machines that are "
        "not their data sheet.",
    ),
    (
        "Conclusion",
        "Test measurements with the real units are needed to validate the simulation.",
        "They are: no measurements of these units are known. What the sensors do on other real machines is in "
        "docs/validation.md.",
    ),
)


def untested(benches: dict[str, Bench]) -> Chapter:
    """The paper's statements that are left."""
    return Chapter(
        "What cannot be tested here",
        (
            f"{len(_STATEMENTS)} statements are about prices, other machines or measurements to come. They are in the "
            "table at the top, with the reason, so that no statement of the paper is passed over.",
        ),
        {},
        tuple(Statement(place, paper, why, Verdict.NOT_TESTABLE) for place, paper, why in _STATEMENTS),
    )
