"""Stretches of a log without rows: a track says so in rows of its own, where a line through it would hide them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import BRIDGED_GAP
from ramsight.signals import Signals, joined

_PERIODS = 2.0  # a stretch takes two rows of its own, a period from either side


class Gaps:
    """Looks for stretches without rows, piece by piece.

    Attributes:
        count: of them.
        longest: of them [s].
        at: when the longest begins [s].

    Example:
        >>> from ramsight.signals import Signal
        >>> gaps, time = Gaps(), np.array([0.0, 0.02, 30.02, 30.04])
        >>> columns = {"time": Signal(time), "position": Signal(np.ones(4)), "status": Signal(np.zeros(4, int))}
        >>> filled = gaps.filled(Signals(columns))
        >>> filled["time"].values.tolist(), [Status(code).name for code in filled["status"].values]
        ([0.0, 0.02, 0.04, 30.0, 30.02, 30.04], ['OK', 'OK', 'INPUT_LOST', 'INPUT_LOST', 'OK', 'OK'])
        >>> gaps.text
        'no rows for 30.0 s from 0.0 s on'
    """

    def __init__(self) -> None:
        self.count, self.longest, self.at = 0, 0.0, 0.0
        self._last: Signals | None = None
        self._period = 0.0

    def filled(self, tracked: Signals) -> Signals:
        """A piece of a track, with rows in the stretches that have none; positions and the like are NaN there.

        Args:
            tracked: with status over time [s].
        """
        time = tracked["time"].values
        if not len(time):
            return tracked
        before = self._last
        self._last = tracked.rows([-1])
        steps = np.diff(time)
        self._period = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else self._period
        places = np.flatnonzero(steps > max(BRIDGED_GAP, _PERIODS * self._period)) + 1
        parts = [self._stretch(tracked, int(place) - 1, float(time[place])) for place in places]
        cut = np.split(np.arange(len(time)), places)
        whole = [tracked.rows(slice(0, len(cut[0])))]
        for part, rows in zip(parts, cut[1:], strict=True):
            whole += [part, tracked.rows(slice(rows[0], rows[-1] + 1))]
        if before is not None and time[0] - before["time"].values[0] > max(BRIDGED_GAP, _PERIODS * self._period):
            whole.insert(0, self._stretch(before, 0, float(time[0])))
        return tracked if len(whole) == 1 else joined(whole)

    def _stretch(self, tracked: Signals, place: int, end: float) -> Signals:
        """Two rows after a sample, until the next one."""
        begin = float(tracked["time"].values[place])
        self.count += 1
        if end - begin > self.longest:
            self.longest, self.at = end - begin, begin
        rows = tracked.rows([place, place])
        unknown = {name: np.full(2, np.nan) for name, one in rows.columns.items() if one.values.dtype.kind == "f"}
        lost: NDArray[np.int_] = np.full(2, int(Status.INPUT_LOST), dtype=rows["status"].values.dtype)
        time = np.array([begin + self._period, end - self._period])
        return rows.replaced({**unknown, "status": lost, "time": time})

    @property
    def text(self) -> str:
        """What to say of them in one line; empty without any."""
        if not self.count:
            return ""
        if self.count == 1:
            return f"no rows for {self.longest:.1f} s from {self.at:.1f} s on"
        return f"{self.count} stretches without rows, the longest {self.longest:.1f} s from {self.at:.1f} s on"
