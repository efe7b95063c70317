"""Steps of the reported speed that no torque goes with: a shaft does not change its speed without one.

A shaft of the inertia J that goes from one speed to another within the time h takes the torque J d omega/h for that
time, beside that of its load. If the drive reports one steady speed and then, from the next report on, another one,
while its torque goes on as before, then one of both speeds is false: its sign is wrong, a bit is stuck, or it is 0.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

FAST = 0.1
"""Of the highest speed; a motor that turns faster is not stopped within a report."""
SHORTEST_STOP = 0.2
"""From the highest speed [s]; a motor that stops sooner may do so between two reports of its torque."""
_STEADY = 0.03  # of a step, by which reports before and after it may differ from another
_QUIET = 0.5  # of the torque that a step takes; oil and moved mass take up to a third of that on themselves


@dataclass(frozen=True)
class _Seen:
    """A report: when it was sent for the first and the last time in a row [s], its speed [rad/s] and torque [N m]."""

    sent: float
    last: float
    speed: float
    torque: float


class ShaftSteps:
    """Compares steps of the speed with the torque around them.

    Args:
        fastest: highest speed of the motor [rad/s].
        inertia: of rotor, belt and pumps at the motor shaft [kg m2].

    Example:
        >>> shaft = ShaftSteps(300.0, 0.01)
        >>> seen = [(100.0, 20.0), (100.0, 20.1), (0.0, 20.2), (0.0, 19.9)]
        >>> [shaft.take(0.02 * k, speed, torque, 0.02) for k, (speed, torque) in enumerate(seen)]
        [False, False, False, True]
    """

    def __init__(self, fastest: float, inertia: float) -> None:
        self._fastest, self._inertia = fastest, inertia
        self._seen: deque[_Seen] = deque(maxlen=4)

    def take(self, sent: float, speed: float, torque: float, period: float) -> bool:
        """A report, and the period of them [s, rad/s, N m, s]; whether the step before it was without a torque."""
        if self._seen and (speed, torque) == (self._seen[-1].speed, self._seen[-1].torque):
            self._seen[-1] = replace(self._seen[-1], last=sent)
            return False
        self._seen.append(_Seen(sent, sent, speed, torque))
        return len(self._seen) == 4 and self._has_stepped(period)

    def _has_stepped(self, period: float) -> bool:
        first, before, after, last = self._seen
        # A drive that sends more often than it measures has measured when it sent a report for the first time.
        passed, step = after.sent - before.sent, abs(after.speed - before.speed)
        steady = max(abs(before.speed - first.speed), abs(last.speed - after.speed)) <= _STEADY * step
        sudden = step > self._fastest * max(FAST, passed / SHORTEST_STOP) and passed > 0.0
        changed = max(abs(one.torque - before.torque) for one in (after, last))
        quiet = passed * changed < _QUIET * self._inertia * step
        return steady and sudden and quiet and after.sent - before.last < 2.0 * period
