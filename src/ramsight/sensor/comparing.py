"""Two sensors of one position against each other: a virtual one, and one in or at the cylinder.

They agree while they are no further apart than the virtual one's bound and the other's tolerance together. If they are
for as long as the time to alert, one of them is wrong; which, the other's own behaviour says where it is impossible for
a piston, and the virtual one's status where that is not ok. Where neither speaks, nobody can tell from two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import IntEnum
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.engine.recursion import Recursion, replay
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import MEASURABLE

Array = NDArray[np.float64]

TOLERANCE, TIME_TO_ALERT = 2e-3, 0.2
"""What a position sensor may be wrong by [m], and for how long two have to be apart [s], if nobody says more."""
LONGEST_ALERT = 60.0
"""The longest time to alert [s]."""

_FASTEST = 1.2  # times the highest velocity, which no piston exceeds
_LEAPS, _LATELY = 2.5, 1.0  # leaps within some s that are no single disturbance


class Verdict(IntEnum):
    """What two sensors say together."""

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
    Verdict.UNCHECKED: "unchecked: the virtual sensor has no position",
    Verdict.APART: "apart: one is wrong, and nothing tells which",
    Verdict.OTHER_WRONG: "the other sensor is wrong",
    Verdict.VIRTUAL_WRONG: "the virtual sensor is wrong, and says that it may be",
}


_INPUTS = ("time", "position", "bound", "status", "other")
_SET = ("stroke", "fastest", "tolerance", "time_to_alert")
_KEPT = ("begun", "time", "shown", "other", "leaps", "impossible", "apart", "since", "anchored", "at", "with_it")


@lru_cache(maxsize=1)
def comparison_graph() -> Recursion:
    """The comparison of a sample as a graph: its inputs, what it is set to, and what it keeps, by name.

    `shown`: whether the other sensor said something at the last sample, `other` what. `leaps`: leaps lately.
    `impossible`: whether it did what no piston does since they last agreed. `apart`, `since`: whether and since when
    they are apart. `anchored`, `at`, `with_it`: where the other one began to stand, and where the virtual one was then.
    """
    x, u, p = (ca.SX.sym(name, len(of)) for name, of in (("x", _KEPT), ("u", _INPUTS), ("p", _SET)))
    begun, last_time, shown, last, leaps, impossible, apart, since, anchored, at, with_it = ca.vertsplit(x)
    time, position, bound, status, other = ca.vertsplit(u)
    stroke, fastest, tolerance, time_to_alert = ca.vertsplit(p)

    says = ca.fabs(other) < MEASURABLE
    elapsed = ca.if_else(begun, time - last_time, 0.0)
    outside = ca.logic_or(other < -tolerance, other > stroke + tolerance)
    far = ca.fabs(other - last) > _FASTEST * fastest * elapsed + 2.0 * tolerance
    leapt = ca.logic_and(ca.logic_and(says, shown), ca.logic_and(elapsed > 0.0, far))
    decayed = leaps * ca.exp(-ca.fmax(elapsed, 0.0) / _LATELY)
    leaps_1 = ca.if_else(says, ca.if_else(elapsed > 0.0, decayed + leapt, leaps), leaps)
    impossible_1 = ca.logic_or(ca.logic_or(impossible, leapt), ca.logic_or(ca.logic_not(says), outside))
    other_wrong = ca.logic_or(ca.logic_not(says), leaps_1 > _LEAPS)
    unchecked = status >= float(Status.NOT_REFERENCED)

    allowed = bound + tolerance
    anew = ca.logic_or(ca.logic_not(anchored), ca.fabs(other - at) > tolerance)
    stands = ca.logic_and(ca.logic_not(anew), ca.fabs(position - with_it) > allowed)
    agree = ca.fabs(position - other) <= allowed
    since_1 = ca.if_else(apart, since, time)
    waits = time - since_1 < time_to_alert
    wrong = ca.if_else(
        ca.logic_or(impossible_1, stands),
        float(Verdict.OTHER_WRONG),
        ca.if_else(status == float(Status.OK), float(Verdict.APART), float(Verdict.VIRTUAL_WRONG)),
    )
    judged = ca.if_else(ca.logic_or(agree, waits), float(Verdict.AGREE), wrong)
    verdict = ca.if_else(
        other_wrong, float(Verdict.OTHER_WRONG), ca.if_else(unchecked, float(Verdict.UNCHECKED), judged)
    )

    def after(before: Any, compared: Any, none: Any = None) -> Any:
        """What is kept: as before while the other one says nothing usable, none while the virtual one knows nothing."""
        return ca.if_else(other_wrong, before, ca.if_else(unchecked, before if none is None else none, compared))

    new = {
        "begun": 1.0,
        "time": time,
        "shown": says,
        "other": ca.if_else(says, other, last),
        "leaps": leaps_1,
        "impossible": after(impossible_1, ca.if_else(agree, 0.0, impossible_1)),
        "apart": after(apart, ca.logic_not(agree), 0.0),
        "since": after(since, since_1),
        "anchored": after(anchored, 1.0, 0.0),
        "at": after(at, ca.if_else(anew, other, at)),
        "with_it": after(with_it, ca.if_else(anew, position, with_it)),
    }
    return Recursion(_KEPT, _INPUTS, _SET, ("verdict",), x, u, p, ca.vertcat(*(new[name] for name in _KEPT)), verdict)


@dataclass
class Comparison:
    """Compares sample by sample.

    Args:
        stroke: of the cylinder [m].
        fastest: velocity of the piston at the highest motor speed [m/s].
        tolerance: of the other sensor, by its data sheet and mounting [m].
        time_to_alert: for which they have to be apart [s].

    Example:
        >>> pair = Comparison(stroke=0.5, fastest=0.2, tolerance=1e-3)
        >>> pair.step(0.0, 0.100, 0.005, 0, 0.101), pair.step(1.0, 0.100, 0.005, 0, 0.110)
        (<Verdict.AGREE: 0>, <Verdict.AGREE: 0>)
        >>> pair.step(1.3, 0.100, 0.005, 0, 0.110)
        <Verdict.APART: 2>
    """

    stroke: float
    fastest: float
    tolerance: float
    time_to_alert: float = TIME_TO_ALERT
    _kept: Array = field(default_factory=lambda: np.zeros(len(_KEPT)), init=False, repr=False)

    def step(self, time: float, position: float, bound: float, status: int, other: float) -> Verdict:
        """One sample.

        Args:
            time: [s], increasing.
            position: by the virtual sensor [m].
            bound: of its error [m].
            status: of it, a number of `Status`.
            other: position by the other sensor [m]; NaN where it says none.
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
    """How a sensor's difference from another changes.

    Attributes:
        offset: at the beginning [m].
        rate: [m/s].
        rate_std: its standard deviation [m/s]; NaN from fewer than three stretches.
        stretches: of time that it was made of.
    """

    offset: float
    rate: float
    rate_std: float
    stretches: int


def drift_of(time: Array, difference: Array, std: Array, stretch: float = 60.0) -> Drift:
    """A straight line through the differences, stretch by stretch, each weighed by the least deviation within it.

    Errors of the virtual sensor last from reference to reference; where its deviation is least, just after one, it says
    most of the other. The line's own scatter says how sure that is.

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
