"""The one place that decides what a counter of a shaft is: when it begins again, how far it went between samples.

A counter that begins again after M numbers says where the shaft is but for whole M. Which one it was is known if the
shaft cannot have gone half of M between two samples, or if a speed says about how far it went. Else it is refused, or,
over a gap in the log, not known there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ramsight.arrays import Array, Bools
from ramsight.constant import Constant
from ramsight.errors import LogError, warn_of_log
from ramsight.logs.align import Block, Samples
from ramsight.logs.clock_going import BITS
from ramsight.logs.mapped import Counted, Mapped
from ramsight.units import RPM

MOST_STEP = Constant(
    1.0 / 3.0, "1", "of what a counter counts until it begins again, between samples: half is too much"
)
MOST_OFF = Constant(0.25, "1", "of the same, by which a speed may miss what the counter says it went")
GAP = Constant(1.5, "1", "usual distances of samples; from this on samples are missing")
LONGEST_GAP = Constant(6.0, "1", "usual distances over which a shaft goes on as it did before and after")
CLEARLY = Constant(0.5, "1", "of the changes of speed that another reading of a counter asks for; else it is asked for")
FINEST = Constant(0.01, "1", "of a turn, by which a number and the next one are apart at least")
MOST_LOST = Constant(0.2, "1", "share of samples between which a speed beside the angle may not tell the turn")
USUAL_SPEED = Constant(1000.0 * RPM, "rad/s", "that the motor of a pump reaches at least, where the map states none")
DISAGREE = Constant(0.02, "1", "share of steps at which a counter and a speed may miss each other")
BESIDE = "speed beside the angle"
"""Key of the speed's channel among those that are held."""


@dataclass
class Unwrapped:
    """A shaft's angle without jumps, in the place of its numbers."""

    file: str
    channel: str
    counted: Counted
    scale: float = 1.0
    speed: tuple[float, float] | None = None  # factor and offset of the speed beside it to rad/s, None without one
    unknown: list[tuple[float, float]] = field(default_factory=list)  # spans in which the angle is not known [s]

    @property
    def named(self) -> dict[str, Mapped]:
        """The channel of the speed beside the angle, if there is one."""
        return {} if self.counted.speed is None else {BESIDE: self.counted.speed}

    def over(self, blocks: Iterator[Block], factor: float, offset: float) -> Iterator[Block]:
        """The blocks with the angle [rad] for the numbers of the role ``speed``; all of them are read first.

        Raises:
            LogError: the numbers do not say how far the shaft went.
        """
        held = list(blocks)
        counts = [block["speed"] for block in held if "speed" in block]
        if counts:
            whole = Samples.join(counts)
            beside = [block[BESIDE] for block in held if BESIDE in block]
            angle = self._angle(whole.time, factor * whole.value + offset, Samples.join(beside) if beside else None)
        begin = 0
        for block in held:
            found = {name: samples for name, samples in block.items() if name != BESIDE}
            if "speed" in block:
                one = block["speed"]
                found["speed"] = Samples(one.order, one.time, angle[begin : begin + len(one)])
                begin += len(one)
            yield found

    def _angle(self, time: Array, numbers: Array, beside: Samples | None) -> Array:
        good = np.isfinite(numbers) & np.isfinite(time)
        known, at = numbers[good], time[good]
        if len(known) < 2:
            self.unknown.append((-math.inf, math.inf))
            return np.zeros(len(numbers))
        if np.spacing(np.abs(known).max()) > FINEST * self.counted.per_turn:
            self._refuse(
                f"reaches {np.abs(known).max():.3g}, and numbers so large cannot be distinguished; write fewer digits"
            )
        expected, spread = (None, None) if beside is None else self._turned(at, beside)
        modulus, steps = self._read(known, at, expected)
        if math.isfinite(modulus) and expected is not None and spread is not None:
            steps = self._by_speed(modulus, steps, at, expected, spread)
        elif math.isfinite(modulus):
            steps = self._checked(modulus, steps, at)
        elif self.counted.modulus is None and expected is None:
            self._check_fast(self._least_bits(known), at)  # so few numbers may be all that it has
        turned = np.concatenate([[0.0], np.cumsum(steps)]) * (2.0 * math.pi / self.counted.per_turn)
        self.unknown += [(-math.inf, float(at[0])), (float(at[-1]), math.inf)]
        self._warn()
        places = np.where(np.isfinite(time), time, np.interp(np.arange(len(time)), np.flatnonzero(good), at))
        order = np.argsort(at, kind="stable")
        found = np.interp(places, at[order], turned[order])
        found[good] = turned
        return found

    def _turned(self, at: Array, beside: Samples) -> tuple[Array, Array]:
        """How far the shaft went by the speed beside the angle, in its numbers, and how wrong that may be."""
        assert self.speed is not None
        factor, offset = self.speed
        known = np.isfinite(beside.value) & np.isfinite(beside.time)
        time, speed = beside.time[known], beside.value[known] * factor + offset
        if len(time) < 2:
            self._refuse("needs the speed beside it, which has no numbers")
        each = (0.5 * (speed[1:] + speed[:-1]) * np.diff(time), 0.5 * np.abs(np.diff(speed)) * np.diff(time))
        ways = [np.interp(at, time, np.concatenate([[0.0], np.cumsum(one)])) for one in each]
        way, spread = (np.diff(one) * self.counted.per_turn / (2.0 * math.pi) for one in ways)
        return way, spread

    def _read(self, known: Array, at: Array, expected: Array | None) -> tuple[float, Array]:
        """When the counter begins again, infinity if it does not, and its steps: as stated, or the smoothest."""
        steps = np.diff(known)
        span, least = float(np.ptp(known)), min(_resolution(known), abs(self.scale))
        if self.counted.modulus is not None:
            if span > self.counted.modulus:
                self._refuse(f"goes over {span:g} numbers, and begins again after {self.counted.modulus:g}: modulus?")
            return self.counted.modulus, _folded(steps, self.counted.modulus, expected)
        if span == 0.0 and self.counted.per_turn < 3.0:
            self._refuse(
                "never changes: numbers that begin again after each turn need three a turn (per_turn); modulus?"
            )
        bits = [abs(self.scale) * 2.0**bits for bits in BITS]
        readings = [m for m in (self.counted.per_turn, math.inf, *bits) if span + least <= m * (1.0 + 1e-9)]
        if self.counted.per_turn in readings:  # within a turn nothing shows that it goes on, and nothing is lost by it
            readings.remove(math.inf)
        tried = [(m, _folded(steps, m, expected)) for m in dict.fromkeys(readings)]  # of equal ones the first counts
        costs = [_cost(one, np.diff(at), expected) for _, one in tried]
        best = int(np.argmin(costs))
        for (modulus, one), cost in zip(tried, costs, strict=True):
            if cost * CLEARLY < costs[best] and not np.array_equal(one, tried[best][1]):
                if tried[0][0] == self.counted.per_turn and expected is None:
                    self._checked(*tried[0], at)  # it goes too far for any reading
                words = "does not" if math.isinf(modulus) else f"does after {modulus:g}"
                mine = "does not" if math.isinf(tried[best][0]) else f"does after {tried[best][0]:g}"
                self._refuse(f"may be one that {mine} begin again, or one that {words}: state modulus, or log faster")
        return tried[best]

    def _by_speed(self, modulus: float, steps: Array, at: Array, expected: Array, spread: Array) -> Array:
        """The steps by the speed beside the angle; where it changes much between its samples none is known."""
        lost = spread > MOST_OFF * modulus
        if lost.mean() > MOST_LOST:
            self._refuse(
                f"needs a speed beside it that is logged faster: at {100.0 * lost.mean():.3g} % of the samples it"
                f" changes so much that it does not show which turn it is, first at {at[int(np.argmax(lost))]:.6g} s"
            )
        off = ~lost & (np.abs(steps - expected) > MOST_OFF * modulus)
        if off.mean() > DISAGREE:
            self._refuse(
                f"and the speed beside it miss each other at {100.0 * off.mean():.3g} % of the samples, first at"
                f" {at[int(np.argmax(off))]:.6g} s: sign, unit, per_turn or modulus?"
            )
        return self._without(lost | off, steps, at)

    def _checked(self, modulus: float, steps: Array, at: Array) -> Array:
        """The steps; over gaps in which more than half of the modulus may have passed the angle is not known."""
        spans = np.diff(at)
        usual = float(np.median(spans))
        self._check_fast(modulus, at)
        normal = spans <= GAP * usual
        changes = np.abs(np.diff(steps, prepend=steps[:1]))
        far = normal & (np.abs(steps) > MOST_STEP * modulus)
        far |= normal & np.concatenate([[True], normal[:-1]]) & (changes > MOST_STEP * modulus)
        if far.any():
            turns = modulus / self.counted.per_turn
            what = "a turn" if turns == 1.0 else f"the {modulus:g} numbers after which it begins again"
            self._refuse(
                f"goes by more than a third of {what} between samples, first at {at[int(np.argmax(far)) + 1]:.6g} s:"
                " from half of it on nobody knows which way; log faster, or name the drive's [speed] beside [angle]"
            )
        rates = np.abs(steps[normal] / spans[normal])
        fastest = float(rates.max()) if rates.size else math.inf
        lost = np.zeros(len(steps), dtype=np.bool_)
        for place in np.flatnonzero(~normal & (fastest * spans > MOST_STEP * modulus)):
            steps[place], lost[place] = self._over_gap(int(place), steps, spans, modulus, usual)
        return self._without(lost, steps, at)

    def _least_bits(self, known: Array) -> float:
        """The least numbers of a binary counter that has all that were seen."""
        span = float(np.ptp(known))
        return next((m for bits in BITS if (m := abs(self.scale) * 2.0**bits) > span), math.inf)

    def _check_fast(self, modulus: float, at: Array) -> None:
        """Refuse a counter of which half passes between samples at a speed that motors have."""
        usual = float(np.median(np.diff(at)))
        most = 0.5 * modulus / self.counted.per_turn / usual * 2.0 * math.pi
        if most <= (self.counted.fastest or USUAL_SPEED):
            stated = "fastest states more" if self.counted.fastest else "motors of pumps turn faster: state fastest"
            self._refuse(
                f"goes by half of what it counts between samples, {1e3 * usual:.4g} ms apart, at {most / RPM:.4g} rpm,"
                f" and {stated}; log faster, name the drive's [speed] beside [angle], or state modulus"
            )

    def _over_gap(self, place: int, steps: Array, spans: Array, modulus: float, usual: float) -> tuple[float, bool]:
        """The step over a gap, as fast as before and after it; and whether it is not known."""
        around = [k for k in (place - 1, place + 1) if 0 <= k < len(steps) and spans[k] <= GAP * usual]
        rates = [steps[k] / spans[k] for k in around]
        due = float(np.mean(rates)) * spans[place] if rates else math.nan
        step = steps[place] + modulus * np.round((due - steps[place]) / modulus) if rates else 0.0
        is_sure = (
            len(rates) == 2
            and spans[place] <= LONGEST_GAP * usual
            and abs(rates[1] - rates[0]) * spans[place] <= MOST_OFF * modulus
            and abs(step - due) <= MOST_OFF * modulus
        )
        return float(step), not is_sure

    def _without(self, lost: Bools, steps: Array, at: Array) -> Array:
        self.unknown += [(float(at[place]), float(at[place + 1])) for place in np.flatnonzero(lost)]
        return np.where(lost, 0.0, steps)

    def _warn(self) -> None:
        gaps = [span for span in self.unknown if math.isfinite(span[0]) and math.isfinite(span[1])]
        if gaps:
            often = "a gap" if len(gaps) == 1 else f"{len(gaps)} gaps, the first"
            warn_of_log(
                f"does not say how far the shaft went in {often} from {gaps[0][0]:.6g} s to {gaps[0][1]:.6g} s: half of"
                " what it counts may have passed; the speed is missing there",
                file=self.file,
                column=self.channel,
            )

    def _refuse(self, text: str) -> None:
        raise LogError(f"the counter {text}", file=self.file, column=self.channel)


def _folded(steps: Array, modulus: float, expected: Array | None) -> Array:
    """The steps but for whole moduli, as near as can be to what is expected."""
    if math.isinf(modulus):
        return steps
    due = np.zeros(len(steps)) if expected is None else expected
    return np.asarray(steps + modulus * np.round((due - steps) / modulus))


def _cost(steps: Array, spans: Array, expected: Array | None) -> float:
    """What a reading asks for: changes of speed from sample to sample, or differences from the speed beside it."""
    if expected is not None:
        return float(np.abs(steps - expected).sum())
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = np.where(spans > 0.0, steps / spans, 0.0)
    return float(np.abs(np.diff(rates, prepend=rates[:1])).sum())


def _resolution(known: Array) -> float:
    """The least distance of two numbers that differ, 0 without any."""
    apart = np.diff(np.unique(known))
    return float(apart.min()) if apart.size else 0.0
