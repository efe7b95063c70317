"""Planned calibration visits: which reference gains most for its time, and when the next one is due.

What a sensor does not know of its position, its leakage and its displacement is a covariance. A move makes the
position's part grow, by the time for which its load leaks and by its way; a visit to an end stop measures the position,
and with it whatever has made it wrong since the last one. So what is expected of a visit can be worked out before it is
made. Left out are compliance, the thermometer's lag and how leakage goes with pressure: it is a lower limit.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ramsight.arrays import Array
from ramsight.closed_loop.thresholds import HORIZON, MOST_VISITS, NEARLY_SHARE, WORTH_SHARE
from ramsight.control.actuation import Actuation
from ramsight.control.position import PositionControl
from ramsight.sensor.kind import Kind, covariance_of, state_of
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.virtual_sensor import VirtualSensor


@dataclass(frozen=True)
class Leg:
    """A move that is to come."""

    way: float  # [m], extension positive
    load: float  # on the way [N]
    speed: float  # [m/s]

    @property
    def time(self) -> float:
        """How long it takes [s], ramps left aside."""
        return abs(self.way) / self.speed


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What is not known of a cylinder.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> new = Knowledge(Actuation.of(boom), np.diag([1e-3, 0.15, 0.006]) ** 2)
        >>> leg = Leg(0.4, 200e3, 0.028)
        >>> f"{1e3 * new.std:.0f} mm, {1e3 * new.after(leg).std:.0f} mm"
        '1 mm, 4 mm'
        >>> known = new.after(leg).referenced()
        >>> f"{1e3 * known.after(leg).std:.0f} mm"
        '2 mm'
    """

    by: Actuation  # the cylinder's motor speeds, with what is known of leakage and temperature
    covariance: Array  # of position [m], factors of leakage and displacement [1], shape (3, 3)

    @classmethod
    def of(cls, sensor: VirtualSensor, control: PositionControl) -> Knowledge:
        """What a sensor does not know now, of the cylinder that a control drives."""
        return cls(control.learned, learned_covariance(sensor))

    @property
    def std(self) -> float:
        """Standard deviation of the position [m]."""
        return math.sqrt(max(float(self.covariance[0, 0]), 0.0))

    def after(self, leg: Leg) -> Knowledge:
        """What is not known after a move."""
        by, assumed = self.by, self.by.unit.assumptions
        leaks = float(by.holding.leakage(leg.load, by.temperature))  # of a pump as its data sheet has it
        rate = -by.unit.lift_sign * leaks * float(by.holding.travel_per_radian(leg.load))
        grows = np.eye(3)
        grows[0, 1:] = rate * leg.time, leg.way
        noise = 2.0 * assumed.drive.correlation * (assumed.drive.torque_gain * float(by.leak) * rate) ** 2 * leg.time
        walks = (assumed.machine.leak_walk**2, assumed.machine.displacement_walk**2)
        gained = np.diag([noise + assumed.machine.walk**2 * abs(leg.way), *(one * leg.time for one in walks)])
        return replace(self, covariance=grows @ self.covariance @ grows.T + gained)

    def over(self, legs: Iterable[Leg]) -> tuple[Knowledge, list[float]]:
        """What is not known after moves, and the position's standard deviation after each [m]."""
        known, stds = self, []
        for leg in legs:
            known = known.after(leg)
            stds.append(known.std)
        return known, stds

    def referenced(self) -> Knowledge:
        """What is not known once the position was measured, by an end stop or a switch."""
        seen = self.covariance[:, 0]
        variance = self.by.unit.assumptions.stops.reference**2
        return replace(self, covariance=self.covariance - np.outer(seen, seen) / (seen[0] + variance))


@dataclass(frozen=True)
class Visit:
    """A visit to an end stop that could be made."""

    lifted: bool  # the stop at the end of lifting; else that of lowering
    # slow: as slowly as a reference is looked for all the way, so that more leaks, and more is learned of that
    slow: bool = False
    # turns: place from which the stop is visited [m], so that the way there is long enough; NaN: from where it is
    turns: float = math.nan

    def legs(self, control: PositionControl, position: float, load: float) -> tuple[Leg, ...]:
        """Its moves, from a position [m] under a load [N]."""
        end = control.end(lifted=self.lifted)
        turns = position if math.isnan(self.turns) else self.turns
        full = control.limits.speed
        slow = control.tuning.homing_share * full if self.slow else full
        legs = (Leg(turns - position, load, full), Leg(end - turns, load, slow))
        return tuple(leg for leg in legs if leg.way != 0.0)


@dataclass(frozen=True)
class Expected:
    """What is expected of visits, one after the other."""

    visits: tuple[Visit, ...]  # the visits; none if it is empty
    cost: float  # time that they take [s], the way back to work among it
    std: float  # root of the mean square of the position's standard deviations after each move of the work [m]


def expected(
    known: Knowledge,
    control: PositionControl,
    position: float,
    load: float,
    work: Sequence[tuple[float, float]],
    visits: Sequence[Visit],
) -> Expected:
    """What is expected of visits, one after the other, before some work.

    Args:
        known: what is not known now.
        control: of the cylinder.
        position: where it is [m].
        load: on it [N].
        work: targets [m] and loads on the way there [N].
        visits: to make.
    """
    cost, at = 0.0, position
    for visit in visits:
        legs = visit.legs(control, at, load)
        known, at = known.over(legs)[0].referenced(), control.end(lifted=visit.lifted)
        cost += sum(leg.time for leg in legs) + control.tuning.pressing
    back = abs(work[0][0] - at) - abs(work[0][0] - position)
    cost += max(back, 0.0) / control.limits.speed if visits else 0.0
    return Expected(tuple(visits), cost, _rms(known.over(_legs(control, at, work))[1]))


def plan(
    known: Knowledge,
    control: PositionControl,
    position: float,
    load: float,
    work: Sequence[tuple[float, float]],
    visits: Sequence[Visit],
    most: int = int(MOST_VISITS),
) -> Expected:
    """The visits to make before some work: the quickest of those that bring nearly all that could be gained.

    One visit alone may gain nothing, as it cannot separate leakage from displacement, and the next one much; so they
    are looked at together.

    Args:
        known: what is not known now.
        control: of the cylinder.
        position: where it is [m].
        load: on it [N].
        work: targets [m] and loads on the way there [N].
        visits: that could be made.
        most: so many at most.

    Returns:
        The visits, none if they would bring less than `WORTH_SHARE` of the standard deviation.
    """
    ways = [way for count in range(most + 1) for way in product(visits, repeat=count)]
    found = [expected(known, control, position, load, work, way) for way in ways]
    without, best = found[0].std, min(one.std for one in found)
    if without - best < WORTH_SHARE * without:
        return found[0]
    enough = best + NEARLY_SHARE * (without - best)
    return min((one for one in found if one.std <= enough), key=lambda one: one.cost)


def due(
    known: Knowledge,
    control: PositionControl,
    position: float,
    work: Sequence[tuple[float, float]],
    limit: float,
    longest: float = HORIZON,
) -> float:
    """Time of work that is left until the position's standard deviation exceeds a limit [s].

    Args:
        known: what is not known now.
        control: of the cylinder.
        position: where it is [m].
        work: targets [m] and loads on the way there [N], done again and again.
        limit: of the standard deviation [m].
        longest: time after which no more is looked for [s].
    """
    passed, at = 0.0, position
    while passed < longest:
        before = passed
        for leg in _legs(control, at, work):
            if known.std > limit:
                return passed
            known, passed = known.after(leg), passed + leg.time
        at = work[-1][0]
        if passed == before:
            return longest
    return longest


def _legs(control: PositionControl, position: float, work: Sequence[tuple[float, float]]) -> list[Leg]:
    begins = [position, *(target for target, _ in work[:-1])]
    speed = control.limits.speed
    return [Leg(target - begin, load, speed) for begin, (target, load) in zip(begins, work, strict=True)]


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(value**2 for value in values) / len(values))


def learned_factors(sensor: VirtualSensor) -> tuple[float, float]:
    """Factors of leakage and displacement [1]."""
    state = sensor.state
    leakage, displacement = (state[state_of(Kind.DESCRIBED, one)] for one in (Quantity.LEAKAGE, Quantity.DISPLACEMENT))
    return leakage, displacement


def learned_covariance(sensor: VirtualSensor) -> Array:
    """Covariance of position [m], factors of leakage and displacement [1], shape (3, 3)."""
    state, of = sensor.state, (Quantity.POSITION, Quantity.LEAKAGE, Quantity.DISPLACEMENT)
    pairs = [[sorted((i, j), key=of.index) for j in of] for i in of]
    return np.array([[state[covariance_of(Kind.DESCRIBED, *pair)] for pair in row] for row in pairs])
