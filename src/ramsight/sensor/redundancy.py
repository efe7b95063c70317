"""Which faults a set of signals can show at all, and which it can distinguish: structural analysis of the model.

A model is a list of equations and the unknowns in each. What has more equations than unknowns can be checked: that part
is found by a largest matching (Dulmage and Mendelsohn). A fault is detectable if its equation is there; it is
distinguished from another one if it still is there without the other's equation (Krysander and Frisk, IEEE Trans.
SMC-A 38, 2008). It shows what no method can do, whatever its thresholds; not how large a fault has to be.
"""

from __future__ import annotations

from collections.abc import Sequence

from ramsight.logs.channels import PRESSURE_A
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.inputs.sample import DC_POWER, SHAFT_ANGLE, declared_inputs
from ramsight.sensor.report.detectors import COUNTER, POWER, PRESSURES

MODEL = {
    "speed": {"w"},
    "torque": {"tau"},
    "temperature": {"oil"},
    "counter": {"w"},
    "DC power": {"w", "tau"},
    "pressures": {"p"},
    "reference": {"x"},
    "pumps' torque": {"tau", "w", "p", "oil"},
    "pumps' flow": {"w", "p", "oil", "x"},
    "load": {"p", "F"},
}
"""Equations by name, with their unknowns: what each signal measures, and the laws between them. The load is unknown;
the position follows from the flow and from where it began, which a reference reports."""
LAWS = ("pumps' torque", "pumps' flow", "load")
KNOWN = {"one load": {"F"}, "inertia": {"w", "tau"}}
"""What may be known beside signals: a load; and the torque that a ramp of the shaft asks for, by its inertia."""
REPORTED = ("speed", "torque", "temperature")


def overdetermined(equations: dict[str, set[str]]) -> set[str]:
    """Names of the equations that can be checked.

    Example:
        >>> sorted(overdetermined({"one": {"x"}, "two": {"x"}, "three": {"x", "y"}}))
        ['one', 'two']
    """
    by_unknown = matching(equations)
    reached = list(equations.keys() - by_unknown.values())
    found = set(reached)
    while reached:  # along alternating paths from equations that are left over
        for unknown in equations[reached.pop()]:
            other = by_unknown[unknown]  # it has one: else the matching were not the largest
            if other not in found:
                found.add(other)
                reached.append(other)
    return found


def matching(equations: dict[str, set[str]]) -> dict[str, str]:
    """A largest matching: for an unknown the equation that it is computed from, each equation for one at most."""
    by_unknown: dict[str, str] = {}

    def gets_one(name: str, tried: set[str]) -> bool:
        """Whether an equation gets an unknown, others changing theirs where they can."""
        for unknown in sorted(equations[name]):
            if unknown in tried:
                continue
            tried.add(unknown)
            if unknown not in by_unknown or gets_one(by_unknown[unknown], tried):
                by_unknown[unknown] = name
                return True
        return False

    for name in equations:
        gets_one(name, set())
    return by_unknown


def declared(assumed: Assumptions) -> tuple[str, ...]:
    """What a machine declares beside what every drive reports, by the names of `MODEL`."""
    inputs = declared_inputs(assumed)
    found = {COUNTER: SHAFT_ANGLE, POWER: DC_POWER, PRESSURES: PRESSURE_A.name}
    return tuple(name for name, one in found.items() if one in inputs)


def model(further: Sequence[str]) -> dict[str, set[str]]:
    """The equations that hold with a set of signals."""
    given = (*REPORTED, *(one for one in further if one in MODEL), *LAWS)
    known = {name: unknowns for name, unknowns in KNOWN.items() if name in further}
    return {name: MODEL[name] for name in given} | known


def detectable(further: Sequence[str]) -> dict[str, tuple[str, ...] | None]:
    """By signal: those whose faults cannot be distinguished from its own; None where its own cannot be seen at all."""
    equations = model(further)
    signals = [name for name in equations if name not in LAWS and name not in KNOWN]
    seen = overdetermined(equations)
    found: dict[str, tuple[str, ...] | None] = {}
    for one in signals:
        if one not in seen:
            found[one] = None
            continue
        rest = {other: {k: v for k, v in equations.items() if k != other} for other in signals if other != one}
        found[one] = tuple(other for other, left in rest.items() if other in seen and one not in overdetermined(left))
    return found
