"""The bus's time stamps on a clock that never jumps.

Time stamps say best when a frame was sent, but they are often those of a wall clock, which someone may set. They are
followed as long as they agree with the local clock, which only runs forward; after a jump they are followed again.
"""

from __future__ import annotations

import math

_JUMP = 0.1  # s; by more than this a time stamp goes back only because a clock was set
_LATE = 1.0  # s; no queue is so long, so the clock lags
_CREEP = 1e-3  # share of the lag that is forgotten with each frame: clocks drift, and queues are emptied


class BusClock:
    """Local times of frames.

    Example:
        >>> clock = BusClock()
        >>> [round(clock.time(stamp, now), 3) for stamp, now in ((1000.0, 5.0), (1000.02, 5.021), (4600.04, 5.041))]
        [5.0, 5.02, 5.041]
    """

    def __init__(self) -> None:
        self._ahead = math.nan  # s, of the bus's clock
        self._last = -math.inf

    def time(self, stamp: float, now: float) -> float:
        """When a frame was sent, by the local clock [s].

        Args:
            stamp: the frame's time stamp [s]; NaN takes the local clock.
            now: the local clock [s].
        """
        if not math.isfinite(stamp):
            return now
        lag = now - (stamp - self._ahead)
        if math.isnan(lag) or lag < 0.0 or lag > _LATE or stamp < self._last - _JUMP:
            self._ahead = stamp - now
        elif stamp > self._last:
            self._ahead -= _CREEP * lag
        self._last = stamp
        return min(stamp - self._ahead, now)
