"""What would make an error smaller, by the linear budget: no machine is simulated again."""

from __future__ import annotations

from ramsight.machine.description import Machine
from ramsight.study.datasheet.budget import Budget, budget
from ramsight.study.datasheet.goal import MEASURES
from ramsight.study.datasheet.quantities import varied
from ramsight.study.datasheet.study_plan import Plan

_WORTH = 0.1  # share of the error's variance, below which a measure is not named


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
