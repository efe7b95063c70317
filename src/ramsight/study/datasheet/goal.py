"""What has to be done for an error: the cheapest measures that reach it, run to see that they do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

from ramsight.machine.description import Machine
from ramsight.study.datasheet.quantities import varied
from ramsight.study.datasheet.run_tasks import run
from ramsight.study.datasheet.sheet import data_sheet
from ramsight.study.datasheet.statistics import Known
from ramsight.study.datasheet.study_plan import Plan

_TRIED = 256  # machines of a trial
_HOPE = 1.15  # times the goal, up to which a combination that is only estimated is tried


@dataclass(frozen=True)
class Measure:
    """Something that can be done about an error.

    Args:
        name: what is done.
        effort: by which measures are compared, 1 for an afternoon with the machine as it is.
        tolerances: that are left by it, as text; only what is narrower than before counts.
        visit_every: time from one reference to the next that it asks for [s]; None if it asks for none.
    """

    name: str
    effort: int
    tolerances: Mapping[str, str]
    visit_every: float | None = None


MEASURES = (
    Measure("a leak test at commissioning", 1, {"leakage": "± 5 % normal"}),
    Measure("a reference every 20 s of work", 1, {}, visit_every=20.0),
    Measure(
        "the data sheet identified from a day with a measured position (ramsight identify)",
        2,
        {
            "leakage": "± 4 % normal",
            "displacement": "± 0.1 % normal",
            "stiffness": "± 10 % normal",
            "pump_friction": "± 5 % normal",
            "friction": "± 10 % normal",
        },
    ),
    Measure("relief valves set with a gauge", 2, {"relief": "± 1 % normal"}),
    Measure(
        "a thermometer in the pump's line",
        3,
        {"thermometer_offset": "± 0.5 K", "thermometer_lag": "5 s ± 5 s"},
    ),
    Measure("the drive's torque calibrated", 4, {"torque_gain": "± 0.6 % normal", "torque_offset": "± 0.1 % normal"}),
)
"""What is tried. The tolerances that are left are usual ones [G]; what that is worth the runs say."""


@dataclass(frozen=True)
class Trial:
    """Measures that were tried.

    Args:
        measures: by their names.
        effort: of all of them.
        known: 95 % error after the third reference, of all machines, with its interval [m].
        machines: that it rests on.
        seed: of these machines; another one for those that no trial had.
    """

    measures: tuple[str, ...]
    effort: int
    known: Known
    machines: int
    seed: int

    @property
    def reached(self) -> float:
        """The 95 % error [m]."""
        return self.known.value


@dataclass(frozen=True)
class Way:
    """How a goal is reached.

    Attributes:
        goal: 95 % error that is asked for [m].
        trials: in the order in which they were run; the first with nothing done.
        chosen: the cheapest that reaches the goal, on machines that no trial had; None if none does.
    """

    goal: float
    trials: tuple[Trial, ...]
    chosen: Trial | None


def way_to(
    goal: float, machine: Machine, study: Plan, *, client: Any = None, advance: Callable[[int], object] = lambda n: None
) -> Way:
    """The cheapest measures that reach a goal.

    Each is tried by itself; what several make together is estimated from that, and tried in the order of their effort.
    What reaches the goal is run again on other machines.

    Args:
        goal: 95 % error after the third reference, of all machines together [m].
        machine: the description.
        study: that the goal is for.
        client: of Dask distributed; None for the threads of this process.
        advance: called with the number of machines that are done since the last call.
    """

    def tried(measures: tuple[Measure, ...], seed: int) -> Trial:
        other = with_measures(machine, study, measures, seed)
        found = run(other, None, client=client, advance=advance)
        names, effort = tuple(one.name for one in measures), sum(one.effort for one in measures)
        return Trial(names, effort, data_sheet(other, found).best.quantiles[1], other.count, seed)

    trials = [tried((), study.seed)]
    if trials[0].reached <= goal:
        return Way(goal, tuple(trials), trials[0])
    gains: dict[str, float] = {}
    for one in MEASURES:
        trials.append(tried((one,), study.seed))
        gains[one.name] = max(trials[0].reached ** 2 - trials[-1].reached ** 2, 0.0)
    known = {trial.measures: trial for trial in trials}
    several = [found for size in range(1, len(MEASURES) + 1) for found in combinations(MEASURES, size)]
    for measures in sorted(several, key=lambda found: (sum(one.effort for one in found), len(found))):
        names = tuple(one.name for one in measures)
        left = trials[0].reached ** 2 - sum(gains[name] for name in names)
        last = len(measures) == len(MEASURES)
        if names not in known and (left <= (_HOPE * goal) ** 2 or last):
            known[names] = tried(measures, study.seed)
            trials.append(known[names])
        if names in known and known[names].reached <= goal:
            again = tried(measures, study.seed + 1)
            trials.append(again)
            if again.reached <= goal:
                return Way(goal, tuple(trials), again)
    return Way(goal, tuple(trials), None)


def with_measures(machine: Machine, study: Plan, measures: tuple[Measure, ...], seed: int) -> Plan:
    """The study of a machine that measures were taken on; of a tolerance that several leave the narrowest is left.

    Args:
        machine: the description.
        study: without them.
        measures: that are taken.
        seed: of the machines.
    """
    held = {one.name: one for one in study.quantities}
    visits = [one.visit_every for one in measures if one.visit_every is not None]
    work = replace(study.work, visit_every=min([study.work.visit_every, *visits]))
    for measure in measures:
        for one in varied(machine, study.unit, dict(measure.tolerances)):
            if one.name in measure.tolerances and one.name in held and one.spread.std < held[one.name].spread.std:
                held[one.name] = replace(one, source=measure.name)
    return replace(study, work=work, quantities=tuple(held.values()), count=min(_TRIED, study.count), seed=seed)
