"""Two sensors of one position against each other: a virtual one, and one in or at the cylinder.

They agree while they are no further apart than the virtual one's bound and the other's tolerance together. If they are
for as long as the time to alert, one of them is wrong; which, the other's own behaviour says where it is impossible for
a piston, and the virtual one's status where that is not ok. Where neither speaks, nobody can tell from two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ramsight.sensor.status import Status

Array = NDArray[np.float64]

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
    time_to_alert: float = 0.2
    _since: float = field(default=math.nan, init=False, repr=False)
    _time: float = field(default=math.nan, init=False, repr=False)
    _last: float = field(default=math.nan, init=False, repr=False)
    _anchor: tuple[float, float] = field(default=(math.nan, math.nan), init=False, repr=False)
    _leaps: float = field(default=0.0, init=False, repr=False)
    _impossible: bool = field(default=False, init=False, repr=False)

    def step(self, time: float, position: float, bound: float, status: int, other: float) -> Verdict:
        """One sample.

        Args:
            time: [s], increasing.
            position: by the virtual sensor [m].
            bound: of its error [m].
            status: of it, a number of `Status`.
            other: position by the other sensor [m]; NaN where it says none.
        """
        before, elapsed = self._last, time - self._time
        self._time, self._last = time, other
        if not math.isfinite(other):
            self._impossible = True
            return Verdict.OTHER_WRONG
        if not -self.tolerance <= other <= self.stroke + self.tolerance:
            self._impossible = True
        if elapsed > 0.0:
            self._leaps *= math.exp(-elapsed / _LATELY)
            if abs(other - before) > _FASTEST * self.fastest * elapsed + 2.0 * self.tolerance:
                self._impossible, self._leaps = True, self._leaps + 1.0
        if self._leaps > _LEAPS:
            return Verdict.OTHER_WRONG
        if status >= Status.NOT_REFERENCED:
            self._since, self._anchor = math.nan, (math.nan, math.nan)
            return Verdict.UNCHECKED
        allowed = bound + self.tolerance
        stands = self._stands(position, other, allowed)
        if abs(position - other) <= allowed:
            self._since, self._impossible = math.nan, False
            return Verdict.AGREE
        if math.isnan(self._since):
            self._since = time
        if time - self._since < self.time_to_alert:
            return Verdict.AGREE
        if self._impossible or stands:
            return Verdict.OTHER_WRONG
        return Verdict.APART if status == Status.OK else Verdict.VIRTUAL_WRONG

    def _stands(self, position: float, other: float, allowed: float) -> bool:
        """Whether the other one stands still while the piston goes further than both could be wrong by."""
        begun, at = self._anchor
        if math.isnan(begun) or abs(other - at) > self.tolerance:
            self._anchor = (position, other)
            return False
        return abs(position - begun) > allowed


def verdicts(
    pair: Comparison, time: Array, position: Array, bound: Array, status: NDArray[np.int64], other: Array
) -> NDArray[np.int16]:
    """A whole log; arguments as `Comparison.step`, shape (samples,)."""
    rows = zip(time.tolist(), position.tolist(), bound.tolist(), status.tolist(), other.tolist(), strict=True)
    return np.array([pair.step(*row) for row in rows], dtype=np.int16)


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
