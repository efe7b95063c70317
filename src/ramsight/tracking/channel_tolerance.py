"""The tolerance between two sensors of one position, from how far each may be off.

Two sensors are apart where |x − y| > b(t) + T, with the bound b of the virtual one and the tolerance T of the other
(`ramsight.tracking.comparing`). Their errors are normal and independent, with the standard deviations s(t) and q:

    p(t) = 2 Q((b + T) / √(s² + q²))

is the probability that healthy sensors are that far from each other. An alert needs it for the whole time to alert A,
so that it covers one at least of instants that are A apart: there are at most mean(p) / A false alerts in a second,
however the errors are correlated. The other one's noise can look like jumps, and those count beside:
2 Q(2 T / (√2 q)) a sample.

An error D that stays, of either sensor, is found at an instant with the probability

    d(t) = Q((b + T − D) / √(s² + q²)) + Q((b + T + D) / √(s² + q²)).

The virtual sensor states a standard deviation, a 95 % band and a bound that one sample in 100 000 exceeds. s is the
smallest one with which a normal distribution is within none of the three. Farther out than the bound nothing is
stated: there it is the normal distribution that is assumed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array, Bools
from ramsight.errors import DescriptionError
from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import RISK

STEP = 1e-5
"""A tolerance is a multiple of this [m], rounded up."""
_ROUNDING = 1e-3  # of a sample, where a time is a whole number of them
_STEPS = 60  # of a bisection: a stroke to less than a picometre


def stated_std(position: Array, std: Array, low: Array, high: Array, bound: Array) -> Array:
    """Standard deviation of the smallest normal distribution that has all that a virtual sensor states [m].

    Args:
        position: estimated [m].
        std: its standard deviation [m].
        low: lower end of its 95 % band [m].
        high: upper end of it [m].
        bound: that one sample in 100 000 exceeds [m].

    Example:
        >>> one = np.ones(1)
        >>> float(stated_std(0 * one, one, -2.5 * one, 1.9 * one, 4 * one)[0].round(3))
        1.276
    """
    with needing("identify"):
        from scipy.special import ndtri

    quantile = -float(ndtri(0.5 * RISK))
    band = np.maximum(high - position, position - low) / TWO_SIDED_95
    found: Array = np.maximum(np.maximum(std, band), bound / quantile)
    return found


@dataclass(frozen=True)
class Channels:
    """Two sensors over a log."""

    duration: Array  # of each sample [s], shape (samples,)
    checked: Bools  # whether the comparison judges the sample; it does not where the virtual sensor has no position
    bound: Array  # of the virtual sensor [m]
    std: Array  # of it, by `stated_std` [m]
    other_std: float  # of the other one, of all that it is off by [m]
    time_to_alert: float  # for which they have to be apart [s]
    stroke: float  # of the cylinder [m]

    @classmethod
    def of(
        cls,
        time: Array,
        status: NDArray[np.int64],
        bound: Array,
        std: Array,
        *,
        other_std: float,
        time_to_alert: float,
        stroke: float,
    ) -> Channels:
        """From what a sensor states over time [s]; other arguments as those of the class.

        A sample behind which time is missing, stands or goes back lasts for nothing; the last one lasts as usual.

        Raises:
            DescriptionError: no time passes.
        """
        steps = np.diff(time)
        steps = np.where(steps > 0.0, steps, 0.0)
        if not steps.any():
            raise DescriptionError("no time passes in the log, so that no rate can be stated")
        duration = np.append(steps, np.median(steps[steps > 0.0]))
        checked = (status < Status.NOT_REFERENCED) & (bound < stroke)
        return cls(duration, checked, bound, std, other_std, time_to_alert, stroke)

    @property
    def period(self) -> float:
        """Usual time between samples [s]."""
        return float(np.median(self.duration[self.duration > 0.0]))

    def false_alerts(self, tolerance: float) -> float:
        """Upper bound of the rate of false alerts with a tolerance [m], per second that is compared."""
        here = self.checked & (self.duration > 0.0)
        if not here.any():
            return math.nan
        size = (self.bound[here] + tolerance) / self._spread[here]
        beyond = 2.0 * _tail(size)
        apart = float(np.average(beyond, weights=self.duration[here])) / max(self.time_to_alert, self.period)
        jumps = 2.0 * float(_tail(np.array(math.sqrt(2.0) * tolerance / self.other_std))) / self.period
        return apart + jumps

    def coverage(self, tolerance: float, drift: float, within: float = 0.0) -> float:
        """Share of errors that stay and are found, over all instants at which they may come.

        Args:
            tolerance: [m].
            drift: size of the error [m].
            within: time in which it has to be found [s]; 0 for at once.
        """
        limit = self.bound + tolerance
        found = _tail((limit - drift) / self._spread) + _tail((limit + drift) / self._spread)
        found = np.where(self.checked, found, 0.0)
        best = forward_most(found, 1 + int(within / self.period + _ROUNDING))
        return float(np.average(best, weights=self.duration))

    @property
    def _spread(self) -> Array:
        return np.hypot(self.std, self.other_std)


def _tail(size: Array) -> Array:
    """Upper tail of the standard normal distribution."""
    with needing("identify"):
        from scipy.special import ndtr

    found: Array = ndtr(-size)
    return found


def forward_most(values: Array, count: int) -> Array:
    """The largest of each value and of those behind it, so many together.

    Example:
        >>> forward_most(np.array([1.0, 5.0, 2.0, 3.0, 0.0]), 3)
        array([5., 5., 3., 3., 0.])
    """
    best, span = values.copy(), 1
    while span < min(count, len(values)):
        step = min(span, count - span)
        best[:-step] = np.maximum(best[:-step], best[step:])
        span += step
    return best


@dataclass(frozen=True)
class Asked:
    """What two sensors are to achieve together."""

    coverage: float  # share of errors of size `drift` that is found
    rate: float  # of false alerts [1/s]
    drift: float  # size of an error that stays [m]
    within: float  # in which it has to be found [s]


@dataclass(frozen=True)
class DerivedTolerance:
    """The smallest tolerance with few enough false alerts, and what it detects."""

    asked: Asked  # what was asked for
    # the smallest multiple of 0.01 mm with which false alerts are rare enough [m]; None if the stroke is too small for
    # that
    tolerance: float | None
    rate: float  # of false alerts with it [1/s]
    coverage: float  # share that is found with it
    # smallest error of which it finds as many as asked [m]; None if it does of none up to the stroke
    least_drift: float | None
    narrow: float | None  # the largest tolerance that finds as many of the errors as asked [m]; None if there is none
    narrow_rate: float  # of false alerts with that [1/s]
    narrow_coverage: float  # share that is found with the narrowest tolerance of all, 0
    checked: float  # share of the time in which there is a comparison

    @property
    def possible(self) -> bool:
        """Whether false alerts are rare enough and as many errors are found as asked, with one tolerance."""
        return self.tolerance is not None and self.coverage >= self.asked.coverage


def derive(channels: Channels, asked: Asked) -> DerivedTolerance:
    """The tolerance between two sensors."""
    stroke, drift, within = channels.stroke, asked.drift, asked.within

    def quiet(tolerance: float) -> bool:
        return channels.false_alerts(tolerance) <= asked.rate

    def finds(tolerance: float) -> bool:
        return channels.coverage(tolerance, drift, within) >= asked.coverage

    tolerance = _rounded_up(_least(quiet, stroke))
    wide = (
        None
        if tolerance is None
        else _least(lambda d: channels.coverage(tolerance, d, within) >= asked.coverage, stroke)
    )
    past = _least(lambda t: not finds(t), stroke)
    narrow = None if not finds(0.0) else stroke if past is None else past
    duration = channels.duration
    return DerivedTolerance(
        asked,
        tolerance,
        math.nan if tolerance is None else channels.false_alerts(tolerance),
        math.nan if tolerance is None else channels.coverage(tolerance, drift, within),
        wide,
        narrow,
        math.nan if narrow is None else channels.false_alerts(narrow),
        channels.coverage(0.0, drift, within),
        float(duration[channels.checked].sum() / duration.sum()),
    )


def _rounded_up(tolerance: float | None) -> float | None:
    return None if tolerance is None else STEP * max(math.ceil(tolerance / STEP), 1)


def _least(holds: Callable[[float], bool], most: float) -> float | None:
    """The smallest size from which on a condition holds, 0 to `most`; None if it does not at `most`."""
    if not holds(most):
        return None
    low, high = 0.0, most
    if holds(low):
        return low
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high
