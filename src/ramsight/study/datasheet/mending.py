"""What would make an error smaller, by the linear budget: no machine is simulated again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ramsight.machine.description import Machine
from ramsight.study.datasheet.budget import Budget, budget
from ramsight.study.datasheet.quantities import varied
from ramsight.study.datasheet.study_plan import Plan

_WORTH = 0.1  # share of the error's variance, below which a measure is not named


@dataclass(frozen=True)
class Measure:
    """Something that can be done about an error.

    Args:
        name: what is done.
        tolerances: that are left by it, as text.
    """

    name: str
    tolerances: Mapping[str, str]


MEASURES = (
    Measure("a leak test at commissioning", {"leakage": "± 5 % normal"}),
    Measure(
        "the data sheet identified from a day with a measured position (ramsight identify)",
        {
            "leakage": "± 4 % normal",
            "displacement": "± 0.1 % normal",
            "stiffness": "± 10 % normal",
            "pump_friction": "± 5 % normal",
            "friction": "± 10 % normal",
        },
    ),
    Measure("relief valves set with a gauge", {"relief": "± 1 % normal"}),
    Measure("a thermometer in the pump's line", {"thermometer_offset": "± 0.5 K", "thermometer_lag": "5 s ± 5 s"}),
    Measure("the drive's torque calibrated", {"torque_gain": "± 0.6 % normal", "torque_offset": "± 0.1 % normal"}),
)
"""What is looked at. The tolerances that are left are usual ones [G]."""


def mending(machine: Machine, study: Plan, known: Budget | None = None) -> list[str]:
    """Measures that take most of the error's variance, with their share, the largest first.

    Args:
        machine: its description.
        study: whose tolerances and sensitivities count.
        known: the study's budget, where it was made already.
    """
    found = budget(study, 0, None) if known is None else known
    shares = dict(zip(found.names, found.linear.shares.tolist(), strict=True))
    before = {one.name: one.spread.std for one in study.quantities}
    worth = []
    for measure in MEASURES:
        after = varied(machine, study.unit, dict(measure.tolerances))
        taken = sum(
            shares[one.name] * max(1.0 - (one.spread.std / before[one.name]) ** 2, 0.0)
            for one in after
            if one.name in measure.tolerances and before.get(one.name, 0.0) > 0.0
        )
        worth.append((taken, measure.name))
    best = sorted((one for one in worth if one[0] > _WORTH), reverse=True)
    return [f"{name} ({100 * taken:.0f} % of the error's variance)" for taken, name in best]
