"""How much of the time a position may be used for what somebody wants to do with it.

A use has an alarm limit: an error that it must not meet. The position is *available* for it while its bound is within
that limit and its status is no worse than uncertain; where it is not for longer than the time to alert, that is an
alert. (The terms are those of satellite navigation, RTCA DO-229.)
"""

from __future__ import annotations

import math

import numpy as np

from ramsight.arrays import Array
from ramsight.sensor.status import LEAST
from ramsight.sensor.virtual_sensor import BOUND
from ramsight.signals import Samples

TIME_TO_ALERT, LONGEST_ALERT = 0.2, 60.0
"""For how long a position may be unavailable, or two sensors apart, unless more is declared, and at most [s]."""


class Availability:
    """Counted piece by piece of a track.

    Args:
        limit: the alarm limit [m].
        time_to_alert: for which the position may be unavailable before that is an alert [s].

    Example:
        >>> import numpy as np, xarray
        >>> time, bound = np.arange(0.0, 10.0), np.where(np.arange(10) < 7, 2e-3, 8e-3)
        >>> track = xarray.Dataset(
        ...     {"position_bound": ("time", bound), "status": ("time", np.zeros(10, int))}, coords={"time": time}
        ... )
        >>> counted = Availability(5e-3, 1.0)
        >>> counted.append(track)
        >>> counted.share, counted.alerts, counted.longest
        (0.7, 1, 2.0)
    """

    def __init__(self, limit: float, time_to_alert: float = TIME_TO_ALERT) -> None:
        self.limit, self.time_to_alert = limit, time_to_alert
        self.clear()

    def clear(self) -> None:
        """Count from the beginning."""
        self._samples, self._usable = 0, 0
        self._begun: float | None = None  # when it became unavailable
        self._alerted = False
        self._passed = PassedTime()
        self.alerts = 0
        self.longest = 0.0

    def append(self, tracked: Samples) -> None:
        """Count a piece.

        Args:
            tracked: with position_bound [m] and status over time [s]; without a bound nothing is available.
        """
        time = self._passed.append(tracked["time"].values)
        usable = tracked["status"].values < LEAST[1]
        usable &= tracked[BOUND].values <= self.limit if BOUND in tracked else False
        self._samples += len(time)
        self._usable += int(usable.sum())
        for k in np.flatnonzero(np.diff(usable, prepend=not usable[0]) if len(usable) else usable):
            self._extend(float(time[k]))
            if usable[k]:
                self._begun, self._alerted = None, False
            elif self._begun is None:
                self._begun = float(time[k])
        if len(time):
            self._extend(float(time[-1]))

    def _extend(self, now: float) -> None:
        """An unavailable stretch lasts until now."""
        if self._begun is None:
            return
        lasts = now - self._begun
        self.longest = max(self.longest, lasts)
        if lasts > self.time_to_alert and not self._alerted:
            self.alerts, self._alerted = self.alerts + 1, True

    @property
    def share(self) -> float:
        """Share of the samples at which the position is available; NaN before the first."""
        return self._usable / self._samples if self._samples else np.nan

    @property
    def text(self) -> str:
        """The availability in one line."""
        alerts = f"{self.alerts} alert{'' if self.alerts == 1 else 's'}"
        more = f", the longest {self.longest:.1f} s" if self.alerts else ""
        return (
            f"available {100 * self.share:.1f} % of the time, its bound within {1e3 * self.limit:g} mm; "
            f"{alerts} of more than {self.time_to_alert:g} s{more}"
        )


_LONGEST = 1e8  # s, three years; a longer step is a clock that was set, from 1970 or 1601 to now


class PassedTime:
    """Counts the time of a log, piece by piece.

    Attributes:
        seconds: that have passed [s].

    Example:
        >>> passed = PassedTime()
        >>> passed.append(np.array([5.0, 6.0, np.nan, 8.0])).tolist(), passed.append(np.array([2.0, 3.0])).tolist()
        ([0.0, 1.0, 1.0, 3.0], [3.0, 4.0])
    """

    def __init__(self) -> None:
        self.seconds, self._last = 0.0, math.nan

    def append(self, time: Array) -> Array:
        """Take the times of a piece [s]; how much has passed at each of its samples since the first of all [s]."""
        known = np.isfinite(time)
        steps = np.zeros(len(time))
        with np.errstate(over="ignore"):
            steps[known] = np.diff(time[known], prepend=self._last if math.isfinite(self._last) else time[known][:1])
        steps[~((steps > 0.0) & (steps <= _LONGEST))] = 0.0
        passed = self.seconds + np.cumsum(steps)
        if known.any():
            self._last = float(time[known][-1])
        if len(passed):
            self.seconds = float(passed[-1])
        return passed
