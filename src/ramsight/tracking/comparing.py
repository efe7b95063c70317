"""Two sensors of one position against each other: a virtual one, and one in or at the cylinder.

They agree while they are no further apart than the virtual one's bound and the other's tolerance together. If they are
for as long as the time to alert, one of them is wrong; which, the other's own behaviour shows where no piston can
behave so, and the virtual one's status where that is not ok. Where neither does, two cannot decide.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array
from ramsight.engine.recursion import Graph, Recursion, replay
from ramsight.engine.typed_state import column, initial_values, leaf, leaves, symbols
from ramsight.expression import Flag, Scalar, all_of, any_of, count, flag, negated, scalar_symbol
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import JUMPS_MOST, MEASURABLE_LIMIT, MEMORY_TIME, OTHER_FASTEST
from ramsight.tracking.availability import TIME_TO_ALERT

TOLERANCE = 2e-3
"""What a position sensor may be wrong by [m], unless more is declared."""


class Verdict(IntEnum):
    """What two sensors show together."""

    AGREE = 0
    UNCHECKED = 1
    APART = 2
    OTHER_WRONG = 3
    VIRTUAL_WRONG = 4

    @property
    def text(self) -> str:
        """The words for it."""
        return _TEXT[self]


ALERTS = (Verdict.APART, Verdict.OTHER_WRONG, Verdict.VIRTUAL_WRONG)
"""Verdicts that one of the two is wrong."""
_TEXT = {
    Verdict.AGREE: "both agree",
    Verdict.UNCHECKED: "unchecked: the virtual sensor has no position, or may be off by the whole stroke",
    Verdict.APART: "apart: one is wrong, and which is unknown",
    Verdict.OTHER_WRONG: "the other sensor is wrong",
    Verdict.VIRTUAL_WRONG: "the virtual sensor is wrong, and reports that it may be",
}


_INPUTS = ("time", "position", "bound", "status", "other")
_SET = ("stroke", "fastest", "tolerance", "time_to_alert")


@dataclass(frozen=True, kw_only=True)
class ComparisonState:
    """What is kept of two sensors of one position."""

    begun: Flag = leaf("1")  # whether there was a sample
    time: Scalar = leaf("s", exact="time")  # of it
    shown: Flag = leaf("1")  # whether the other sensor had a position at it
    other: Scalar = leaf("m")  # which
    jumps: Scalar = leaf("1")
    impossible: Flag = leaf("1")  # whether it did what no piston does since they last agreed
    apart: Flag = leaf("1")  # whether they are apart
    since: Scalar = leaf("s", exact="time")  # since when
    anchored: Flag = leaf("1")  # whether the other one stands
    at: Scalar = leaf("m")  # where it began to
    with_it: Scalar = leaf("m")  # where the virtual one was then


def compare(
    state: ComparisonState, sample: Mapping[str, Scalar], settings: Mapping[str, Scalar]
) -> tuple[ComparisonState, Scalar]:
    """One sample of both, and the verdict as a number.

    Args:
        settings: of the comparison, by their names.
    """
    time, position, other = sample["time"], sample["position"], sample["other"]
    stroke, tolerance = settings["stroke"], settings["tolerance"]
    shows = ca.fabs(other) < MEASURABLE_LIMIT
    elapsed = ca.if_else(state.begun, time - state.time, 0.0)
    outside = any_of(other < -tolerance, other > stroke + tolerance)
    reach = OTHER_FASTEST * settings["fastest"] * elapsed + 2.0 * tolerance
    jumped = all_of(all_of(shows, state.shown), all_of(elapsed > 0.0, ca.fabs(other - state.other) > reach))
    decayed = state.jumps * ca.exp(-ca.fmax(elapsed, 0.0) / MEMORY_TIME)
    jumps = ca.if_else(shows, ca.if_else(elapsed > 0.0, decayed + count(jumped), state.jumps), state.jumps)
    impossible = any_of(any_of(state.impossible, jumped), any_of(negated(shows), outside))
    other_wrong = any_of(negated(shows), jumps > JUMPS_MOST)
    # Within a bound as wide as the stroke the other one may be anywhere.
    unchecked = any_of(sample["status"] >= float(Status.NOT_REFERENCED), sample["bound"] >= stroke)

    allowed = sample["bound"] + tolerance
    starts = any_of(negated(state.anchored), ca.fabs(other - state.at) > tolerance)
    stands = all_of(negated(starts), ca.fabs(position - state.with_it) > allowed)
    agree = ca.fabs(position - other) <= allowed
    since = ca.if_else(state.apart, state.since, time)
    waits = time - since < settings["time_to_alert"]
    by_status = ca.if_else(sample["status"] == float(Status.OK), float(Verdict.APART), float(Verdict.VIRTUAL_WRONG))
    wrong = ca.if_else(any_of(impossible, stands), float(Verdict.OTHER_WRONG), by_status)
    judged = ca.if_else(any_of(agree, waits), float(Verdict.AGREE), wrong)
    judged = ca.if_else(unchecked, float(Verdict.UNCHECKED), judged)
    verdict = ca.if_else(other_wrong, float(Verdict.OTHER_WRONG), judged)
    after = ComparisonState(
        begun=flag(True),
        time=time,
        shown=shows,
        other=ca.if_else(shows, other, state.other),
        jumps=jumps,
        impossible=ca.if_else(any_of(other_wrong, unchecked), state.impossible, all_of(impossible, negated(agree))),
        apart=ca.if_else(other_wrong, state.apart, all_of(negated(unchecked), negated(agree))),
        since=ca.if_else(any_of(other_wrong, unchecked), state.since, since),
        anchored=ca.if_else(other_wrong, state.anchored, negated(unchecked)),
        at=ca.if_else(any_of(other_wrong, unchecked), state.at, ca.if_else(starts, other, state.at)),
        with_it=ca.if_else(any_of(other_wrong, unchecked), state.with_it, ca.if_else(starts, position, state.with_it)),
    )
    return after, verdict


@lru_cache(maxsize=1)
def comparison_graph() -> Recursion:
    """The comparison of a sample as a recursion: inputs, settings and states by name."""
    sample = {name: scalar_symbol(name) for name in _INPUTS}
    settings = {name: scalar_symbol(name) for name in _SET}
    before = symbols(ComparisonState())
    after, verdict = compare(before, sample, settings)
    names = tuple(one.name for one in leaves(before))
    x, u, p = column(before), ca.vertcat(*sample.values()), ca.vertcat(*settings.values())
    return Recursion(names, _INPUTS, _SET, ("verdict",), lambda: Graph(x, u, p, column(after), verdict))


@dataclass
class Comparison:
    """Compares sample by sample.

    Example:
        >>> pair = Comparison(stroke=0.5, fastest=0.2, tolerance=1e-3)
        >>> pair.step(0.0, 0.100, 0.005, 0, 0.101), pair.step(1.0, 0.100, 0.005, 0, 0.110)
        (<Verdict.AGREE: 0>, <Verdict.AGREE: 0>)
        >>> pair.step(1.3, 0.100, 0.005, 0, 0.110)
        <Verdict.APART: 2>
    """

    stroke: float  # of the cylinder [m]
    fastest: float  # velocity of the piston at the highest motor speed [m/s]
    tolerance: float  # of the other sensor, by its data sheet and mounting [m]
    time_to_alert: float = TIME_TO_ALERT  # for which they have to be apart [s]
    _kept: Array = field(default_factory=lambda: initial_values(ComparisonState()), init=False, repr=False)

    @classmethod
    def of(cls, unit: HydraulicUnit, tolerance: float, time_to_alert: float = TIME_TO_ALERT) -> Comparison:
        """Of two sensors of a unit's piston, with a tolerance [m] and a time to alert [s]."""
        fastest = float(unit.travel_per_radian) * float(unit.max_speed)
        return cls(float(unit.cylinder.stroke), fastest, tolerance, time_to_alert)

    def step(self, time: float, position: float, bound: float, status: int, other: float) -> Verdict:
        """One sample.

        Args:
            time: [s], increasing.
            position: by the virtual sensor [m].
            bound: of its error [m].
            status: of it, a number of `Status`.
            other: position by the other sensor [m]; NaN where it reports none.
        """
        return Verdict(int(self._replayed(np.array([[time, position, bound, float(status), other]]))[0]))

    def _replayed(self, rows: Array) -> Array:
        values = np.array([self.stroke, self.fastest, self.tolerance, self.time_to_alert])
        return replay(comparison_graph(), rows, values, self._kept)[:, 0]


def verdicts(
    pair: Comparison, time: Array, position: Array, bound: Array, status: NDArray[np.int64], other: Array
) -> NDArray[np.int16]:
    """A whole log; arguments as `Comparison.step`, shape (samples,)."""
    return pair._replayed(np.column_stack([time, position, bound, status.astype(float), other])).astype(np.int16)


@dataclass(frozen=True)
class Drift:
    """How a sensor's difference from another changes."""

    offset: float  # at the beginning [m]
    rate: float  # [m/s]
    rate_std: float  # its standard deviation [m/s]; NaN from fewer than three stretches
    stretches: int  # of time that it was made of


def drift_of(time: Array, difference: Array, std: Array, stretch: float = 60.0) -> Drift:
    """A straight line through the differences, stretch by stretch, each weighed by the least deviation within it.

    Errors of the virtual sensor last from reference to reference; where its deviation is least, just after one, it
    shows most of the other. The line's own scatter shows how sure that is.

    Args:
        time: [s], shape (samples,).
        difference: other less virtual position [m].
        std: standard deviation of the virtual one [m].
        stretch: length of a stretch, longer than a usual way between references [s].

    Example:
        >>> t = np.arange(0.0, 600.0, 1.0)
        >>> found = drift_of(t, 1e-3 + 1e-5 * t, np.full(600, 1e-3))
        >>> round(found.offset, 6), round(found.rate, 8)
        (0.001, 1e-05)
    """
    places = ((time - time[0]) // stretch).astype(int)
    when, what, sure = [], [], []
    for place in np.unique(places):
        here = places == place
        best = here & (std <= 1.2 * std[here].min())
        when.append(float(time[best].mean() - time[0]))
        what.append(float(np.median(difference[best])))
        sure.append(1.0 / max(float(std[best].min()), 1e-6))
    count = len(when)
    if count < 2:
        return Drift(what[0] if what else math.nan, math.nan, math.nan, count)
    if count < 3:
        line = np.polyfit(when, what, 1, w=sure)
        return Drift(float(line[1]), float(line[0]), math.nan, count)
    line, covariance = np.polyfit(when, what, 1, w=sure, cov=True)
    return Drift(float(line[1]), float(line[0]), float(np.sqrt(covariance[0, 0])), count)
