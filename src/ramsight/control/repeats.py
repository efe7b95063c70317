"""How often a report that is alive repeats by chance, so that one that is stuck can be told from it.

A value that is rounded to steps and has noise is now and then the same as the one before. Of a steady value the noise
falls into the step k with the chance p_k, and n repeats in a row, n + 1 equal reports, with

    P(n) = sum over k of p_k^(n + 1),    p_k = Phi((k + 1/2) s) - Phi((k - 1/2) s),    s = step/noise,

where Phi is the normal distribution; a value in the middle of a step repeats most often. (The square of the chance of
one repeat is less than that of two: what repeated is likely to lie well within its step.) A value that moves repeats
less often.
"""

from __future__ import annotations

import math
from enum import Enum
from itertools import pairwise
from statistics import NormalDist

FALSE_ALARMS = 1.0 / 3.6e6  # 1/s: one in a thousand hours of each kind, which is half a year of a machine's work
KNOWN_AFTER = 3.0  # repeats that are taken to have been seen before any: of rare events, with 95 % (rule of three)
SURELY = 10.0  # runs that are too long, of which a speed without noise would have shown one
_FAR = 6.0  # standard deviations, beyond which no value is looked for: one in 500 million
_NEVER = 1.0e9  # samples; half a year


def runs(share: float, period: float) -> int:
    """Samples in a row, of which each is met by chance with this share, that are rarer than `FALSE_ALARMS`.

    Args:
        share: chance of one sample [1].
        period: of the samples [s].

    Example:
        >>> runs(0.0, 0.02), runs(0.05, 0.02), runs(0.2, 0.02)
        (1, 7, 12)
    """
    if share <= 0.0:
        return 1
    return max(math.ceil(math.log(FALSE_ALARMS * period) / math.log(share)), 1)


def repeats(count: int, noise: float, step: float, off: float = 0.0) -> float:
    """Chance that a steady value is reported as often again as it was just now [1].

    Args:
        count: repeats, one or more.
        noise: standard deviation before it is rounded.
        step: to which it is rounded, in the same unit.
        off: by which the value is off the middle of a step, in the same unit.

    Example:
        >>> [round(repeats(1, noise, 1.0), 3) for noise in (0.5, 1.0, 2.0)]
        [0.516, 0.271, 0.14]
        >>> round(repeats(2, 1.0, 1.0), 3)
        0.085
    """
    normal, reach = NormalDist(off, noise), math.ceil(_FAR * noise / step) + 1
    edges = [normal.cdf((k - 0.5) * step) for k in range(-reach, reach + 2)]
    return sum((after - before) ** (count + 1) for before, after in pairwise(edges))


def repeats_in_a_row(noise: float, step: float, period: float) -> float:
    """Repeats of a steady value that are rarer than `FALSE_ALARMS`, worst case over where it lies in a step.

    Args:
        noise: standard deviation before it is rounded; 0: there is none, and it may repeat for ever.
        step: to which it is rounded, in the same unit; 0: it never repeats.
        period: of the samples [s].

    Returns:
        A whole number, or infinity.

    Example:
        >>> [repeats_in_a_row(noise, 1.0, 0.02) for noise in (0.0, 1.0, 2.0, 10.0)]
        [inf, 19, 11, 6]
    """
    if step <= 0.0:
        return 1
    if noise <= 0.0:
        return math.inf
    likeliest = 2.0 * NormalDist().cdf(0.5 * step / noise) - 1.0
    if likeliest >= 1.0 or math.log(FALSE_ALARMS * period) / math.log(likeliest) > _NEVER:
        return math.inf
    count = max(math.floor(runs(likeliest, period) / 2) - 1, 1)
    while repeats(count, noise, step) > FALSE_ALARMS * period:
        count += 1
    return count


class Seen:
    """How often something was seen among samples, and what share of them it may have by that.

    Attributes:
        samples: looked at.

    Example:
        >>> seen = Seen()
        >>> seen.share
        1.0
        >>> seen.add(300, 27)
        >>> round(seen.share, 3)
        0.099
    """

    def __init__(self) -> None:
        self.samples = self._met = 0

    def add(self, samples: int, met: int) -> None:
        """So many samples, and in so many of them it was."""
        self.samples, self._met = self.samples + samples, self._met + met

    @property
    def share(self) -> float:
        """With 95 %, it is no more often, where it is rare [1]; 1 before any samples."""
        return (self._met + KNOWN_AFTER) / (self.samples + KNOWN_AFTER)


class Going(Enum):
    """What a command does while reports of it are looked at."""

    STANDS = "stands"
    TREMBLES = "trembles"  # within the noise of the reports: with that of a sensor, say
    GOES = "goes"


class SpeedRepeats:
    """Whether a speed repeats for longer than its declared noise lets it, while its command stands or trembles.

    The declaration is not taken on trust. How often one repeat is followed by another is learned from runs that ended,
    apart for commands that stand and that tremble. Until so many samples were seen that a speed without noise would
    have shown a run that is too long ten times, no run is an alarm; and where more repeats follow than the noise has
    it, that counts in its place. A run that is too long for the declared noise and ends after all says that there is
    no such noise: from then on no run is an alarm.

    Args:
        noise: declared standard deviation of the reported speed [rad/s].
        step: in which it is reported [rad/s].
        period: of the samples [s].

    Attributes:
        believed: whether the declared noise is there, by all that was seen.

    Example:
        >>> import random
        >>> random.seed(1)
        >>> watched = SpeedRepeats(1.0, 1.0, 0.02)
        >>> any(watched.look(float(round(random.gauss(100.0, 1.0))), Going.STANDS) for _ in range(2000))
        False
        >>> [watched.look(50.0, Going.STANDS) for _ in range(30)].index(True)
        19
    """

    def __init__(self, noise: float, step: float, period: float) -> None:
        self._period, self._enough = period, repeats_in_a_row(noise, step, period)
        self._known = {going: Known() for going in (Going.STANDS, Going.TREMBLES)}
        self.believed = math.isfinite(self._enough)
        self.forget()

    def forget(self) -> None:
        """Count anew, and learn nothing of what was counted: the motor stands, or its torque is at its limit."""
        self._speed, self._alarm, self._any = math.nan, False, False
        for known in self._known.values():
            known.begin()

    def look(self, speed: float, going: Going) -> bool:
        """Whether a report [rad/s] is one too many of a run."""
        known = self._known.get(going)
        if speed != self._speed:
            self._learn(known)
            self.forget()
            self._speed = speed
        elif known is not None:
            known.repeated(follows=self._any)
            self._any = True
            surely = known.repeats >= self._enough and known.samples >= SURELY * self._enough
            self._alarm = self._alarm or (self.believed and surely and known.repeats >= known.least(self._period))
        if known is not None:
            known.looked += 1
        return self._alarm

    def _learn(self, ends: Known | None) -> None:
        """From a run that a new value ended, if it was no alarm; `ends`: what is known of commands like the newest."""
        if self._alarm:
            return
        self.believed = self.believed and all(known.repeats < self._enough for known in self._known.values())
        for known in self._known.values():
            known.learn(ended=self._any and known is ends)


class Known:
    """What runs of a report were, while its command did one thing; and the run that has not ended.

    Attributes:
        samples: looked at, of runs that ended.
        looked: samples of this run.
        repeats: of this run.
    """

    def __init__(self) -> None:
        self._seen, self.samples = Seen(), 0
        self.begin()

    def begin(self) -> None:
        """Begin a run."""
        self.looked = self.repeats = self._followed = 0

    def repeated(self, *, follows: bool) -> None:
        """Count a repeat; `follows`: the sample before was one too."""
        self.repeats, self._followed = self.repeats + 1, self._followed + follows

    def learn(self, *, ended: bool) -> None:
        """From this run; `ended`: a repeat was followed by another value."""
        self.samples += self.looked
        self._seen.add(self._followed + ended, self._followed)

    def least(self, period: float) -> float:
        """Repeats that are rarer than `FALSE_ALARMS` by what was seen [1]; `period` of the samples [s]."""
        share = self._seen.share
        return runs(share, period) if share < 1.0 else math.inf
