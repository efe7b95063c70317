"""The likeliest gross mistake in how a whole log was read: a unit, a scale, exchanged columns, another machine.

Each explanation says what the log's presses, moves and largest values have to be if the machine is the described one.
How well they are met is compared by likelihood with what arbitrary numbers would give. Nothing is said unless the log
as it was read is less likely than `SURE`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean, median

import numpy as np

from ramsight.arrays import Array
from ramsight.constant import Constant
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import Samples
from ramsight.tracking.pressed import Press, Pressed
from ramsight.units import RPM

Reading = Callable[[Array, Array], tuple[Array, Array]]

SPEED_UNITS = {"rpm": RPM, "deg/s": math.pi / 180.0, "rad/s": 1.0}
"""Units in which drives report a speed [rad/s]."""

FACTORS = {"half": 0.5, "double": 2.0}
"""By which a torque is reported wrongly most often: one of two motors, or both for one."""

ARBITRARY = Constant(math.log(50.0**2), "1", "numbers that mean something else may be 50 times too small or too large")
PRESS_STD = Constant(0.05, "1", "relative, of a torque at relief: override of the valve, scale of the drive")
TRAVEL_STD = Constant(0.05, "1", "of a travel from end to end: oil that is compressed, stops that nobody declared")
LEAK_STD = Constant(0.25, "1", "of leakage beside the described one, of new and of worn machines")
LOADED = Constant(0.5, "1", "share of plateaus of the torque that a load makes, the way that the load is lifted")
SURPLUS_STD = Constant(0.35, "1", "relative, by which a machine may leak less than it is described to")
LEAST = Constant(1e-9, "1", "density of what an explanation excludes: sensors and people make other mistakes, too")
UNLOADED = Constant(0.1, "1", "the same the other way, in which loads are rare")
OBSTRUCTED = Constant(0.1, "1", "share of travels between plateaus that end at something else than the cylinder's ends")
INDEPENDENT = Constant(3.0, "1", "plateaus of one way that count by themselves; more of them have the same causes")
MOST_TORQUE = Constant(1.15, "1", "of the torque at relief, that may be reported")
MOST_SPEED = Constant(1.1, "1", "of the highest speed, that may be reported")
MOST_TRAVEL = Constant(1.25, "1", "of the stroke, that a free move may seem to go")
BEYOND_STD = Constant(0.05, "1", "relative, by which a limit of torque or speed may be passed")
FARTHER_STD = Constant(
    0.15, "1", "relative, by which that limit of a free move may be passed: leakage of a worn machine"
)
AGAINST_LOAD = Constant(0.005, "1", "probability that a log's mean torque has another sign than the load asks for")
AGAINST = Constant(0.05, "1", "of the torque at relief: a mean torque that is smaller has no sign")
GAIN_LEAST = Constant(
    0.3, "1", "logarithm of the least factor by which a torque is said to be wrong: valves are set otherwise"
)
GAIN_MOST = Constant(math.log(10.0), "1", "logarithm of the largest")
TELLING = Constant(
    20.0, "s", "of turning, before a log's largest speed and the sign of its mean torque contradict anything"
)
STOP = Constant(0.1, "1", "of the torque at relief, within which a plateau is a stop's")

PRIORS = {
    "as read": 0.96, "rad/s": 0.005, "rpm": 0.005, "deg/s": 0.002, "half": 0.005, "double": 0.005, "gain": 0.005,
    "swapped": 0.005, "reversed": 0.005, "machine": 0.005,
}  # fmt: skip
"""Of a hundred logs with a new channel map some have one of these mistakes; few drives report degrees."""


@dataclass(frozen=True)
class Mistake:
    """What is most likely wrong with how a log was read."""

    role: str  # channel that it concerns: speed, torque, or machine
    text: str
    probability: float  # of it, among all that were compared [1]
    is_of_torque: bool = False  # whether nothing but the torque's scale contradicts the machine


class Explanations:
    """Readings of a log's columns, collected side by side, piece by piece."""

    def __init__(self, unit: HydraulicUnit, speed_unit: str = "rpm") -> None:
        self._unit = unit
        self._now = speed_unit if speed_unit in SPEED_UNITS else "rpm"
        self._readings: dict[str, tuple[Reading, Pressed]] = {}
        self._add("as read", lambda speed, torque: (speed, torque))
        second = SPEED_UNITS[self._now]
        for name, other in SPEED_UNITS.items():
            if name != self._now:
                self._add(name, lambda speed, torque, factor=other / second: (speed * factor, torque))  # type: ignore[misc]
        for name, factor in FACTORS.items():
            self._add(name, lambda speed, torque, factor=factor: (speed, torque / factor))  # type: ignore[misc]
        self._add("swapped", lambda speed, torque: (torque * second, speed / second))
        self._add("reversed", lambda speed, torque: (-speed, -torque))

    def _add(self, name: str, reading: Reading) -> None:
        self._readings[name] = (reading, Pressed(self._unit))

    def take(self, piece: Samples) -> None:
        """Take a piece of a drive log in."""
        time, speed, torque, oil = (
            piece[name].values for name in ("time", "motor_speed", "motor_torque", "oil_temperature")
        )
        for reading, pressed in self._readings.values():
            pressed.take(time, *reading(speed, torque), oil)

    @property
    def mistake(self) -> Mistake | None:
        """The likeliest mistake; None where the log as it was read is likely enough."""
        asread = self._readings["as read"][1]
        if not asread.sides:
            return None
        scored = list(self._scored())
        chances = probabilities([score for score, _, _ in scored])
        if chances[0] >= SURE or (not any(_contradictions(asread, self._unit)) and asread.turning < TELLING):
            return None
        (score, role, text), *others = sorted(scored[1:], reverse=True)
        also = next((other for next_score, kind, other in others if kind != role and next_score > score + WORTH), "")
        shown = f"{text}: {_evidence(asread, self._unit)}" + (f" (or, less likely: {also})" if also else "")
        return Mistake(role, shown, max(chances[1:]), _of_motion(asread) > 0.0)

    def _scored(self) -> Iterator[tuple[float, str, str]]:
        """The logarithm of each explanation's probability but for a constant; the log as it was read first."""
        found = {name: pressed for name, (_, pressed) in self._readings.items()}
        asread = found["as read"]
        yield _log("as read") + evidence(asread), "", ""
        units = [name for name in SPEED_UNITS if name != self._now]
        for name in units:
            yield (
                _log(name) + evidence(found[name]),
                "speed",
                f"the speed is in {name} where it was read in {self._now}",
            )
        for name, factor in FACTORS.items():
            yield _log(name) + evidence(found[name]), "torque", _gain_text(factor)
        gains = _gains(GAIN_LEAST, GAIN_MOST)
        scores = [evidence(asread, gain) for gain in gains]
        likeliest = gains[int(np.argmax(scores))]
        other = "this is the log of another machine than the described one"
        yield _log("gain") + log_mean(scores), "machine", f"{other}, or {_gain_text(likeliest)}"
        yield _log("swapped") + evidence(found["swapped"]), "torque", "speed and torque are exchanged"
        yield (
            _log("reversed") + evidence(found["reversed"]),
            "torque",
            "the signs of speed and torque are both reversed (sign = -1 in the channel map)",
        )
        yield _log("machine") + _of_any_machine(asread), "machine", other


def evidence(pressed: Pressed, gain: float = 1.0) -> float:
    """How much likelier a reading is as one of this machine than as arbitrary numbers; a natural logarithm.

    Args:
        gain: by which the torque was reported too large [1]; what leaks from end to end is not known then.
    """
    return (
        sum(_of_presses(pressed, way, gain) for way in pressed.sides)
        + (_of_visits(visits(pressed.presses)) if gain == 1.0 else 0.0)
        + _of_motion(pressed)
        + _of_limit(pressed.torque / gain, MOST_TORQUE)
        + math.log((AGAINST_LOAD if pressed.pushing / gain < -AGAINST else 1.0 - AGAINST_LOAD) / 0.5)
    )


def visits(presses: list[Press]) -> list[tuple[float, float]]:
    """From one visit of an end to the next: how far the travel is from what it has to be, and from what it may be.

    Visits are plateaus at the torque at relief. From one end to the other the rod goes by the stroke, back to the same
    end by nothing.

    Returns:
        Differences and their standard deviations [strokes].

    Example:
        >>> visits([Press(1, 1.0, 0.7, 0.0), Press(-1, 0.4, 0.6, 0.1), Press(-1, 0.98, -0.3, 0.2)])
        [(0.0, 0.07071067811865475)]
    """
    stops = [one for one in presses if abs(one.level - 1.0) <= STOP]
    found = []
    for a, b in pairwise(stops):
        due = 0.0 if a.way == b.way else float(b.way)
        found.append((b.place - a.place - due, math.hypot(TRAVEL_STD, LEAK_STD * (b.leaked - a.leaked))))
    return found


def _of_presses(pressed: Pressed, way: int, gain: float) -> float:
    """Of the plateaus of one way: at the torque at relief, or below it by a load."""
    levels = [(one.level / gain, one.surplus) for one in pressed.presses if one.way == way]
    if not levels:
        return 0.0
    loaded = LOADED if way == pressed.unit.lift_sign else UNLOADED
    each = []
    for level, surplus in levels:
        seen = (1.0 - loaded) * _normal(math.log(level), PRESS_STD) + loaded * _below(level, MOST_TORQUE)
        possible = math.exp(-0.5 * (min(math.log(surplus), 0.0) / SURPLUS_STD) ** 2)
        each.append(math.log(ARBITRARY * max(seen * possible, LEAST)))
    return median(each) * min(len(each), INDEPENDENT)


def _of_visits(found: list[tuple[float, float]]) -> float:
    """Of the travels from visit to visit of an end: what they have to be, or less where something stood between."""
    each = []
    for off, std in found:
        seen = (1.0 - OBSTRUCTED) * _normal(off, std) + OBSTRUCTED * (0.5 if abs(off) < 1.0 else 0.0)
        each.append(math.log(max(seen, LEAST) * ARBITRARY * math.hypot(off, std)))
    return median(each) * min(len(each), INDEPENDENT) if each else 0.0


def _of_limit(share: float, most: float, std: float = BEYOND_STD) -> float:
    """Of the largest value of a log, of which nothing is known but its limit."""
    return math.log(ARBITRARY * _below(share, most, std)) if share > 0.0 else 0.0


def _of_motion(pressed: Pressed) -> float:
    """Of the longest free move and the largest speed."""
    return _of_limit(pressed.longest, MOST_TRAVEL, FARTHER_STD) + _of_speed(pressed.speed)


def _of_speed(share: float) -> float:
    """Of the largest speed of a log: work uses much of what a drive can do oftener than little of it."""
    return _of_limit(share, MOST_SPEED) + math.log(2.0 * min(share / MOST_SPEED, 1.0)) if share > 0.0 else 0.0


def _below(share: float, most: float, std: float = BEYOND_STD) -> float:
    """Density of the logarithm of something that is anywhere between 0 and its limit, seldom a little beyond it."""
    if share <= most:
        return share / most
    return max(math.exp(-0.5 * (math.log(share / most) / std) ** 2), LEAST)


def _normal(value: float, std: float) -> float:
    return math.exp(-0.5 * (value / std) ** 2) / (std * math.sqrt(2.0 * math.pi))


def _of_any_machine(pressed: Pressed) -> float:
    """Of the plateaus of both ways, each at a torque at relief that nobody knows."""
    gains = _gains(0.0, 0.5 * ARBITRARY)
    return sum(log_mean([_of_presses(pressed, way, gain) for gain in gains]) for way in pressed.sides)


def _gains(least: float, most: float) -> list[float]:
    """Factors by which a torque may be wrong, evenly over the logarithms between these, up and down."""
    far = np.arange(least, most, PRESS_STD)
    return [float(gain) for gain in np.exp(np.concatenate([-far[::-1], far]))]


def _log(name: str) -> float:
    return math.log(PRIORS[name])


def _gain_text(gain: float) -> str:
    return f"the torque is {gain:.2g} times what it should be (scale, unit or rated in the channel map)"


def _evidence(pressed: Pressed, unit: HydraulicUnit) -> str:
    """What of the log as it was read contradicts the machine, in a few words."""
    said = list(filter(None, _contradictions(pressed, unit)))
    turns, most = pressed.speed * unit.max_speed / RPM, unit.max_speed / RPM
    return "; ".join(said) or f"the motor turns up to {turns:.4g} rpm of {most:.0f} rpm"


def _contradictions(pressed: Pressed, unit: HydraulicUnit) -> list[str]:
    """What of the log as it was read cannot be this machine's: levels of presses, travels, the largest torque."""
    said = [_level_text(pressed, way) for way in pressed.sides]
    stroke, largest = 1e3 * unit.cylinder.stroke, max(side.torque for side in pressed.sides.values())
    ends = [abs(b.place - a.place) for a, b in pairwise(pressed.presses) if a.way != b.way]
    going = median(ends) if ends else 1.0
    if not 1.0 / MOST_TRAVEL < going < MOST_TRAVEL:
        said.append(f"from stop to stop the rod would go {going * stroke:.4g} mm of {stroke:.0f} mm")
    elif pressed.longest > MOST_TRAVEL:
        said.append(f"the rod would go {pressed.longest * stroke:.4g} mm in one move of {stroke:.0f} mm")
    if pressed.torque > MOST_TORQUE:
        said.append(
            f"the torque reaches {pressed.torque * largest:.4g} N m, relief pressure asks for {largest:.3g} N m"
        )
    return said


def _level_text(pressed: Pressed, way: int) -> str:
    """At what torque moves end one way, if that is not what relief pressure asks for."""
    highest = max((one.level for one in pressed.presses if one.way == way), default=1.0)
    if abs(highest - 1.0) <= STOP:
        return ""
    asked, verb = pressed.sides[way].torque, "extending" if way > 0 else "retracting"
    return f"{verb}, it ends at {highest * asked:.4g} N m, relief pressure asks for {asked:.3g} N m"


# All scores are natural logarithms, known but for a constant. What is described stands first; another explanation is
# named only where that one has become improbable.

SURE = Constant(0.1, "1", "probability of what is described, below which a mistake is named: it is nine times likelier")
WORTH = math.log(0.05)
"""A second explanation is named if it is no less likely than that share of the first."""


def log_mean(scores: Sequence[float]) -> float:
    """Logarithm of the mean of what has these logarithms.

    Example:
        >>> round(math.exp(log_mean([math.log(1.0), math.log(3.0)])), 12)
        2.0
    """
    highest = max(scores)
    return highest + math.log(fmean(math.exp(score - highest) for score in scores))


def probabilities(scores: Sequence[float]) -> list[float]:
    """Probability of each explanation among all of them.

    Example:
        >>> [round(one, 3) for one in probabilities([0.0, math.log(3.0)])]
        [0.25, 0.75]
    """
    highest = max(scores)
    weights = [math.exp(score - highest) for score in scores]
    total = sum(weights)
    return [weight / total for weight in weights]
