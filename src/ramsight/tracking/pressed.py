"""Where a log presses: a piston at a stop is pressed until a relief valve opens, and the torque stays there.

Such plateaus say two things of a machine, whatever a channel map says. Their level is what relief pressure asks for,
and from one end to the other the rod goes by its stroke. `mistakes` compares both with a description.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array, Bools
from ramsight.constant import Constant
from ramsight.plant.limits import pump_reliefs
from ramsight.plant.oil import T40
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit, side_nodes

SUSTAINED = Constant(
    0.1, "s", "for which a torque stays at a level: longer than a wave in a hose, shorter than a stop's visit"
)
PLATEAU = Constant(0.95, "1", "of the highest sustained torque of a move, from which on it is at its level")
STAYS = Constant(
    0.9, "1", "share of the samples after that, and of the level: a press lasts until the motor is stopped"
)
FREE = Constant(0.8, "1", "of that level, below which the rod still moved freely")
STEADY = Constant(0.25, "1", "of that level, by which the torque of a free move changes while a level is sustained")
LEAD = Constant(3.0, "1", "free angle before a press over the angle of its rise: a load that is lifted rises at once")
TURNING = Constant(0.02, "1", "of the highest speed, from which on the motor turns")
PEAK = Constant(0.995, "1", "quantile that is taken for the largest value: a few samples in a thousand may be wild")
RARE = Constant(5.0, "1", "times that, up to which a torque is no wild sample: a stop may be met once in an hour")
LONGEST_STEP = Constant(1.0, "s", "between samples; after a longer gap nothing is known of what happened meanwhile")
LEAK_TORQUE = Constant(1.2, "1", "of the torque at relief, that leakage is counted up to")


@dataclass(frozen=True)
class Side:
    """What pressing one side to its relief valve asks for."""

    torque: float  # magnitude at the motor [N m]
    leaking: float  # motor speed that makes up for what leaks there, at 40 degC [rad/s]


def pressing_sides(unit: HydraulicUnit) -> dict[int, Side]:
    """The sides that pumps press to a relief valve: 1 while the rod extends, -1 while it retracts.

    Example:
        >>> import ramsight
        >>> sides = pressing_sides(ramsight.build("mining-loader", unit="boom"))
        >>> {way: round(side.torque) for way, side in sides.items()}
        {1: 81, -1: 48}
    """
    viscosity, density = float(unit.oil.viscosity(T40)), float(unit.oil.density_at(T40))
    found = {}
    for way, side in ((1, "a"), (-1, "b")):
        nodes = side_nodes(unit, side)
        pumps = [p for p in unit.parts() if isinstance(p, Pump) and (p.outlet if way > 0 else p.inlet) in nodes]
        settings = [valve.setting for valve in pump_reliefs(unit) if valve.inlet in nodes]
        if not pumps or not settings:
            continue
        pressure = float(min(settings))
        leak = sum(abs(float(p.leakage(0.0, pressure, viscosity, density))) for p in pumps)
        found[way] = Side(
            sum(abs(float(p.shaft_torque(p.nominal_speed, pressure, viscosity))) for p in pumps),
            leak / sum(abs(float(p.geared_displacement)) for p in pumps),
        )
    return found


@dataclass(frozen=True)
class Press:
    """A plateau of the torque at the end of a move."""

    way: int  # 1 while the motor turns to extend the rod, -1 to retract it
    level: float  # of the torque, over what relief pressure asks for on that side [1]
    place: float  # of the rod since the log's beginning, by the motor's angle and the described leakage [strokes]
    leaked: float  # what leakage moved the rod by since the log's beginning, either way [strokes]
    surplus: float = math.inf  # motor speed meanwhile, over what leaks at that torque by the description [1]


@dataclass
class Pressed:
    """Presses of a log, collected piece by piece, by one reading of its columns.

    Attributes:
        pushing: mean torque while the motor turns, positive where the load asks for it, over the same torque [1].
    """

    unit: HydraulicUnit
    presses: list[Press] = field(default_factory=list)
    longest: float = 0.0  # free move of the rod [strokes]
    # speed, torque: 99.5 % of the magnitudes in the liveliest piece are below these, over the highest speed and over
    # the larger torque at relief [1]
    speed: float = 0.0
    torque: float = 0.0
    turning: float = 0.0  # for how long the motor has turned [s]
    _place: float = 0.0
    _leaked: float = 0.0
    _pushed: float = 0.0
    _turned: int = 0

    def __post_init__(self) -> None:
        self.sides = pressing_sides(self.unit)
        self._slowest = TURNING * self.unit.max_speed
        self._per_stroke = abs(self.unit.travel_per_radian) / self.unit.cylinder.stroke
        self._thin = float(self.unit.oil.viscosity(T40))

    @property
    def pushing(self) -> float:
        """Mean torque while the motor turns, positive where the load asks for it, over the torque at relief [1]."""
        return self._pushed / self._turned if self._turned else 0.0

    def take(self, time: Array, speed: Array, torque: Array, temperature: Array) -> None:
        """Take a piece in.

        Args:
            time: [s].
            speed: of the motor [rad/s].
            torque: [N m].
            temperature: of the oil [K].
        """
        known = np.isfinite(time) & np.isfinite(speed) & np.isfinite(torque)
        if known.sum() < 2 or not self.sides:
            return
        time, speed, torque = time[known], _tamed(speed[known]), _tamed(torque[known], RARE)
        steps = np.diff(time, prepend=time[0])
        steps = np.where((steps > 0.0) & (steps <= LONGEST_STEP), steps, 0.0)
        if not steps.any():
            return
        way = np.where(speed > self._slowest, 1, np.where(speed < -self._slowest, -1, 0))
        self.turning += float(steps[way != 0].sum())
        self._measure(speed, torque, way)
        leaking = (way != 0) * self._leaking(torque, temperature)
        free = (speed - leaking) * steps * self._per_stroke
        free[self._at_relief(torque, way)] = 0.0  # the oil goes over the valve
        moves = _moves(way)
        samples = max(2, round(SUSTAINED / float(np.median(steps[steps > 0.0]))))
        found = []
        for first, end in moves:
            if end - first < 3 * samples:
                continue
            press = _press(way[first] * torque[first:end], np.abs(speed[first:end]) * steps[first:end], samples)
            if press is not None:
                begins = first + press[0]
                leaks = float(np.abs(leaking[begins:end]).mean())
                turns = float(np.abs(speed[begins:end]).mean())
                found.append((begins, int(way[first]), press[1], turns / leaks if leaks > 0.0 else math.inf))
                free[begins:end] = 0.0
        place = np.cumsum(free)
        leaked = np.cumsum(np.where(free != 0.0, np.abs(leaking) * steps * self._per_stroke, 0.0))
        self.longest = max([self.longest, *(abs(float(place[end - 1] - place[first])) for first, end in moves)])
        self.presses += [
            Press(
                one,
                level / self.sides[one].torque,
                self._place + float(place[at]),
                self._leaked + float(leaked[at]),
                surplus,
            )
            for at, one, level, surplus in found
            if one in self.sides
        ]
        self._place += float(place[-1])
        self._leaked += float(leaked[-1])

    def _measure(self, speed: Array, torque: Array, way: NDArray[np.int_]) -> None:
        largest = max(side.torque for side in self.sides.values())
        turning = torque[way != 0]
        self.speed = max(self.speed, float(np.abs(speed).max()) / self.unit.max_speed)
        if turning.size:
            self.torque = max(self.torque, float(np.quantile(np.abs(turning), PEAK)) / largest)
            self._pushed += self.unit.lift_sign * float(turning.sum()) / largest
            self._turned += turning.size

    def _leaking(self, torque: Array, temperature: Array) -> Array:
        """Motor speed that only makes up for leakage, positive where the load pulls the rod in [rad/s]."""
        warm = temperature[np.isfinite(temperature)]
        kelvin = float(np.clip(np.median(warm), *self.unit.oil.temperatures)) if warm.size else T40
        thin = self._thin / float(self.unit.oil.viscosity(kelvin))
        found = np.zeros(len(torque))
        for way, side in self.sides.items():
            found += way * thin * side.leaking * np.clip(way * torque / side.torque, 0.0, LEAK_TORQUE)
        return found

    def _at_relief(self, torque: Array, way: NDArray[np.int_]) -> Bools:
        """Samples at which the torque is what relief pressure asks for."""
        found = np.zeros(len(torque), dtype=np.bool_)
        for one, side in self.sides.items():
            found |= (way == one) & (one * torque >= PLATEAU * side.torque)
        return found


def _tamed(values: Array, times: float = 1.0) -> Array:
    """Values of which single wild samples are cut to some times what is usual."""
    most = times * float(np.quantile(np.abs(values), PEAK))
    return np.asarray(np.clip(values, -most, most))


def _moves(way: NDArray[np.int_]) -> list[tuple[int, int]]:
    """First sample and end of each stretch in which the motor turns one way."""
    edges = np.flatnonzero(np.diff(way, prepend=9, append=9))
    return [(int(a), int(b)) for a, b in pairwise(edges) if way[a] != 0]


def _press(torque: Array, turned: Array, samples: int) -> tuple[int, float] | None:
    """Where a move begins to press, and at what level [N m]; None if it moves freely to its end.

    Args:
        torque: positive the way that the motor turns [N m], shape (n,).
        turned: angle of each sample [rad], shape (n,).
    """
    windows = np.lib.stride_tricks.sliding_window_view(torque, samples)
    least, most = windows.min(axis=1), windows.max(axis=1)
    level = float(least.max())
    if level <= 0.0:
        return None
    begins = int(np.argmax(least >= PLATEAU * level))
    if float((torque[begins:] >= STAYS * level).mean()) <= STAYS:
        return None
    before = slice(0, max(begins - samples + 1, 0))
    freely = np.flatnonzero((most[before] < FREE * level) & ((most - least)[before] < STEADY * level))
    if not freely.size:
        return None
    angle = np.cumsum(turned)
    last = int(freely[-1]) + samples - 1
    risen, led = angle[begins] - angle[last], angle[last] - angle[freely[0]]
    return (begins, level) if led > LEAD * risen else None
