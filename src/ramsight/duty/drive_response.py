"""How a drive follows its commands, and how late it reports: delays, bandwidth, acceleration and lost samples.

The largest torque is not here: it is a servo's, in the plant (`ramsight.plant.drive.ServoDrive`), because what a motor
reaches with it depends on its load.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ramsight.argument_kinds import whole_argument
from ramsight.expression import Real
from ramsight.plant.either import choose
from ramsight.units import RPM, argument

_DAMPING = math.sqrt(0.5)  # of a second order without a resonance (Butterworth): -3 dB at its natural frequency


_RANGES = {
    "command_delay": ("s", "0 s", "60 s"),
    "report_delay": ("s", "0 s", "60 s"),
    "bandwidth": ("Hz", "0.01 Hz", "10000 Hz"),
    "acceleration": ("rad/s2", "0.1 rad/s2", "1e7 rad/s2"),
    "lost": ("1", "0", "0.999"),
    "deviation": ("rad/s", "0 rad/s", "1e6 rad/s"),
    "speed_noise": ("rad/s", "0 rad/s", "1e6 rad/s"),
    "speed_step": ("rad/s", "0 rad/s", "1e6 rad/s"),
    "torque_repeats": ("1", "0", "0.999"),
}
"""Unit, least and most of each value: a slip of a sign or a unit is beyond them."""
_UNLIMITED, _OPTIONAL = ("bandwidth", "acceleration"), ("torque_repeats",)


@dataclass(frozen=True)
class DriveResponse:
    """How a drive follows its commands; without a word of it, at once and exactly.

    Args:
        command_delay: from a command to the beginning of its effect [s].
        report_delay: from a speed and a torque to their report [s].
        bandwidth: of the speed loop, where it follows with 0.71 of the amplitude [Hz].
        order: of the speed loop, 1 or 2.
        acceleration: largest of the motor [rad/s2].
        lost: share of the commands, and of the reports, that do not arrive [1].
        deviation: largest error of the speed beyond that [rad/s]; by default what a speed loop of 0.8 N m s/rad gives
            way by when a torque of 4 N m comes.
        speed_noise: standard deviation of the reported speed [rad/s]; by default 2 rpm.
        speed_step: in which the speed is reported [rad/s]; by default 1 rpm.
        torque_repeats: share of the torque's samples that are the one before once more, while the motor turns [1]: much
            where the report's steps are coarse beside its noise; without it, to be learned from the reports.

    Raises:
        DescriptionError: a value cannot be.

    Example:
        >>> lag = DriveResponse(command_delay=0.02, report_delay=0.02, bandwidth=10.0).lag
        >>> f"{1e3 * lag:.1f} ms"
        '55.9 ms'
    """

    command_delay: float = 0.0
    report_delay: float = 0.0
    bandwidth: float = math.inf
    order: int = 1
    acceleration: float = math.inf
    lost: float = 0.0
    deviation: float = 5.0
    speed_noise: float = 2.0 * RPM
    speed_step: float = RPM
    torque_repeats: float | None = None

    def __post_init__(self) -> None:
        whole_argument(self.order, "order", 1, 2)
        for name, (unit, least, most) in _RANGES.items():
            passed = getattr(self, name)
            unlimited = isinstance(passed, float) and passed == math.inf and name in _UNLIMITED
            if not (unlimited or (passed is None and name in _OPTIONAL)):
                object.__setattr__(self, name, argument(passed, unit, name, least=least, most=most))

    @property
    def frequency(self) -> float:
        """The speed loop's natural frequency [rad/s]."""
        return 2.0 * math.pi * self.bandwidth

    @property
    def lag(self) -> float:
        """Time by which a report is behind a command that changes steadily [s]."""
        share = 1.0 if self.order == 1 else 2.0 * _DAMPING
        return self.command_delay + self.report_delay + share / self.frequency


IDEAL = DriveResponse()
"""A drive that follows at once and exactly, and reports at once."""


def between(delay: float, period: float) -> tuple[float, int]:
    """Which share of the oldest of the values that have to be kept is that of a delay ago, and how many these are.

    Args:
        delay: [s].
        period: of the samples [s].

    Example:
        >>> between(0.02, 0.02), between(0.03, 0.02)
        ((0.0, 3), (0.5, 3))
    """
    samples = delay / period
    whole = math.floor(samples + 1e-9)
    return max(samples - whole, 0.0), whole + 2


def delayed(held: Sequence[Real], share: float) -> Real:
    """The value of a delay ago, of values that were kept, the oldest first; numbers or graphs."""
    return (1.0 - share) * held[1] + share * held[0]


class Delay:
    """Values that come later, straight between samples.

    Args:
        delay: by which they do [s].
        period: of the samples [s].

    Example:
        >>> late = Delay(0.03, 0.02, 0.0)
        >>> [late.step(value) for value in (1.0, 2.0, 3.0)]
        [0.0, 0.5, 1.5]
    """

    def __init__(self, delay: float, period: float, value: float) -> None:
        self._share, count = between(delay, period)
        self._held = deque([value] * count, maxlen=count)

    def step(self, value: float) -> float:
        """The value of a delay ago; takes the newest."""
        self._held.append(value)
        return float(delayed(self._held, self._share))


class Follower:
    """A drive's speed loop, a sample at a time.

    Args:
        period: of the samples [s].
        delayed: whether its commands are delayed; lost ones are not looked at here.

    Attributes:
        speed: of the motor at the newest sample [rad/s].

    Example:
        >>> drive = Follower(DriveResponse(bandwidth=10.0), 0.02)
        >>> [round(drive.step(100.0), 1) for _ in range(4)]
        [43.1, 83.8, 95.4, 98.7]
    """

    def __init__(self, response: DriveResponse, period: float, *, delayed: bool = True) -> None:
        self.response, self.period, self.speed = response, period, 0.0
        self._delay = Delay(response.command_delay if delayed else 0.0, period, 0.0)
        self._before, self._slope = 0.0, 0.0

    def step(self, command: float) -> float:
        """The motor's speed at the next sample, where the command [rad/s] is reached evenly."""
        asked = self._delay.step(command)
        self.speed, self._slope = followed(
            self.response, self.period, asked, self._before, (self.speed, self._slope)
        )  # fmt: skip
        self._before = asked
        return self.speed


def followed(
    response: DriveResponse, period: float, asked: Any, before: Any, now: tuple[Any, Any]
) -> tuple[Any, Any]:  # fmt: skip
    """A drive's speed [rad/s] and its rate [rad/s2] after a sample; numbers or graphs.

    Args:
        period: of the samples [s].
        asked: the speed at the end of the sample, reached evenly [rad/s].
        before: that of the sample before [rad/s].
    """
    wanted, slope = (asked, 0.0 * asked)
    if math.isfinite(response.bandwidth):
        wanted, slope = _filtered(response, period, asked, before, now)
    if not math.isfinite(response.acceleration):
        return wanted, slope
    most = response.acceleration * period
    limited = choose(wanted - now[0] > 0.0, response.acceleration, -response.acceleration)
    beyond = abs(wanted - now[0]) > most
    return choose(beyond, now[0] + limited * period, wanted), choose(beyond, limited, slope)


def _filtered(
    response: DriveResponse, period: float, asked: Any, before: Any, now: tuple[Any, Any]
) -> tuple[Any, Any]:  # fmt: skip
    """Speed and its rate after a sample in which what is asked goes straight to its value: the exact solution."""
    frequency, ramp = response.frequency, (asked - before) / period
    if response.order == 1:
        behind = ramp / frequency
        rest = (now[0] - before + behind) * math.exp(-frequency * period)
        return asked - behind + rest, ramp - frequency * rest
    behind, decay = 2.0 * _DAMPING * ramp / frequency, _DAMPING * frequency
    off, rate = now[0] - before + behind, now[1] - ramp
    sine = (rate + decay * off) / decay  # decay and damped frequency are equal at this damping
    swing, fading = decay * period, math.exp(-decay * period)
    rest = fading * (off * math.cos(swing) + sine * math.sin(swing))
    change = fading * decay * (sine * math.cos(swing) - off * math.sin(swing)) - decay * rest
    return asked - behind + rest, ramp + change
