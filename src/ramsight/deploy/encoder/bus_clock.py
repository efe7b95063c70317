"""The bus's time stamps on a clock that never runs backwards.

Time stamps say best when a frame was sent, but they are often those of a wall clock, which someone may set. They are
followed as long as they agree with the local clock, which only runs forward; after a jump back they are followed again.

A jump forward is either a clock that was set, or a computer that slept and whose local clock stood meanwhile: a laptop
whose lid was closed, a virtual machine that was paused. Nothing here tells which, and the piston may have moved: it
counts as time that passed unseen, for at least so long that no sensor integrates over it. A clock that was set costs a
reference.
"""

from __future__ import annotations

import math

from ramsight.sensor.thresholds import BRIDGED_GAP, USUAL_PERIOD

_BACK = 5e-3  # s; by more than this a time stamp goes back only because a clock was set: a bus keeps its order
_AHEAD = 0.04  # s; by more than this no stamp is in the future: twice a usual period
_LATE = 1.0  # s; no queue is so long, so the clock lags
_UNSEEN = BRIDGED_GAP + USUAL_PERIOD  # s; a sensor does not integrate over it
_CREEP = 1e-3  # share of the lag that is forgotten with each frame: clocks drift, and queues are emptied


class BusClock:
    """Local times of frames.

    Attributes:
        stood: for how long the local clock may have stood while the bus's went on [s].

    Example:
        >>> clock, seen = BusClock(), ((1000.0, 5.0), (1000.02, 5.021), (4600.04, 5.041), (4600.06, 5.061))
        >>> [round(clock.time(stamp, now), 3) for stamp, now in seen], round(clock.stood, 2)
        ([5.0, 5.02, 3605.04, 3605.06], 3600.0)
    """

    def __init__(self) -> None:
        self._ahead = math.nan  # s, of the bus's clock
        self._last = -math.inf
        self.stood = 0.0

    def time(self, stamp: float, now: float) -> float:
        """When a frame was sent, by the local clock and the time for which it stood [s].

        Args:
            stamp: the frame's time stamp [s]; NaN takes the local clock.
            now: the local clock [s].
        """
        now += self.stood
        if not math.isfinite(stamp):
            return now
        lag = now - (stamp - self._ahead)
        if lag < -_AHEAD:
            unseen = max(-lag, _UNSEEN)
            self.stood, now = self.stood + unseen, now + unseen
            self._ahead = stamp - now
        elif math.isnan(lag) or lag < 0.0 or lag > _LATE or stamp < self._last - _BACK:
            self._ahead = stamp - now
        elif stamp > self._last:
            self._ahead -= _CREEP * lag
        self._last = stamp
        return min(stamp - self._ahead, now)
