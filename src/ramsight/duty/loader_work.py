"""Work of a wheel loader's cylinder: dig, lift, carry, dump, lower again, with the loads of a real operator's work.

The figures are shares of distributions that were measured on a loader at work (29 digging cycles in 700 s, one
operator) and are given here as such; no measured course is played. Loads are shares of what the relief valve carries:

    of the load 5, 50 and 95 %: 0.05, 0.23, 0.60 (boom), 0.02, 0.18, 0.52 (bucket)
    rests, 10, 50 and 90 %: 0.7, 3.6, 12 s (boom), 0.3, 1.1, 4.1 s (bucket)
    faster than 0.5 Hz: 0.045 in the root mean square, 0.085 while digging

A digging load comes within a tenth of a second and goes as the soil breaks. Nothing of it is a stop: a boom meets no
end at this work. A bucket is curled to its end in four of five cycles, and pressed there for 0.3 to 5 s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.plan import as_driven
from ramsight.duty.profile import Duty, Profile, constant
from ramsight.plant.holding import Holding
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit

_STEP = 0.05  # s between two corners of a load that digs or drives
_CORNER = 0.3  # s, time constant of what is faster than 0.5 Hz
_NOISE, _DIGGING = 0.045, 0.085  # root mean square of that, over the relief load
_MOST, _LEAST = 0.75, -0.1  # of the relief load: what the operator lets come, and a load that pulls
_BEYOND = 0.1  # share of the stroke by which a visit's command goes beyond the end
_RAMPS = (400.0, 2500.0)  # rad/s2, of a joystick
_SPEEDS = (0.25, 1.0)  # share of the highest speed
_DIGS = (2, 4)  # moves in the pile
_DIG_STEP = (0.02, 0.07)  # share of the stroke, of each of them


@dataclass(frozen=True)
class Use:
    """How a cylinder of a loader is used."""

    rest: float  # median of the rests [s]
    spread: float  # deviation of their logarithm
    # low, high: where it digs and where it dumps, shares of the stroke above the lowered end
    low: tuple[float, float]
    high: tuple[float, float]
    # empty, full, peak: loads over the relief load: without, with material, while it breaks out
    empty: tuple[float, float]
    full: tuple[float, float]
    peak: tuple[float, float]
    ends: float  # share of the cycles in which it is driven to its raised end and pressed there


USES = {
    "loader-boom": Use(3.6, 1.1, (0.05, 0.15), (0.6, 0.9), (0.05, 0.15), (0.25, 0.5), (0.5, 0.75), 0.0),
    "loader-bucket": Use(0.8, 0.9, (0.03, 0.2), (0.6, 0.9), (0.02, 0.08), (0.15, 0.35), (0.35, 0.65), 0.8),
}
"""The duties by their names."""


class _Course:
    """Speeds and loads as they come to be, with where the rod would be."""

    def __init__(
        self, unit: HydraulicUnit, use: Use, height: float, kelvin: float, random: np.random.Generator
    ) -> None:
        self.unit, self.use, self.random, self.height = unit, use, random, height
        self.relief, self.stroke = limits_of(unit).load, unit.cylinder.stroke
        self.holding, self.kelvin = Holding(unit), kelvin
        self.time, self.speeds = 0.0, [(0.0, 0.0)]
        self.loads = [(0.0, self.drawn(use.empty))]
        self.digging: list[tuple[float, float]] = []

    def drawn(self, share: tuple[float, float]) -> float:
        return self.relief * float(self.random.uniform(*share))

    def rest(self, duration: float | None = None) -> None:
        if duration is None:
            duration = self.use.rest * math.exp(self.use.spread * float(self.random.standard_normal()))
        self._corner(min(max(duration, 0.2), 60.0), 0.0)

    def load(self, value: float, within: float, at: float | None = None) -> None:
        """Another load from a time on, within some time [N, s, s]."""
        begins = max(self.time if at is None else at, self.loads[-1][0] + 1e-3)
        self.loads += [(begins, self.loads[-1][1]), (begins + within, value)]

    def go(self, height: float, press: float = 0.0) -> None:
        """Move the rod to a height [m]; against an end for some time [s]."""
        up = 1.0 if height > self.height else -1.0
        load = max(self.loads[-1][1], 0.0)
        leak = float(self.holding.leakage(load, self.kelvin))
        most = self.unit.max_speed
        top = max(most * float(self.random.uniform(*_SPEEDS)), min(2.0 * leak, most))
        angle = abs(height - self.height) / abs(self.holding.travel_per_radian(load))
        net = max(top - up * leak, 0.2 * top)
        slope = float(self.random.uniform(*_RAMPS))
        hold, ramp = max(angle / net - top / slope, 0.0) + press, top / slope
        for span, value in ((ramp, top), (hold, top), (ramp, 0.0)):
            self._corner(span, up * self.unit.lift_sign * value)
        self.height = height

    def _corner(self, span: float, value: float) -> None:
        self.time += max(span, 1e-3)
        self.speeds.append((self.time, value))

    def cycle(self) -> None:
        """Dig, lift, carry, dump and come back."""
        use, random, stroke = self.use, self.random, self.stroke
        self.go(stroke * float(random.uniform(*use.low)))
        self.rest()
        began = self.time
        for _ in range(int(random.integers(*_DIGS, endpoint=True))):
            at = self.time + float(random.uniform(0.1, 0.6))
            self.load(self.drawn(use.peak), float(random.uniform(0.1, 0.3)), at)
            self.load(self.drawn(use.full), float(random.uniform(0.1, 0.8)), at + float(random.uniform(0.3, 1.5)))
            self.go(min(self.height + stroke * float(random.uniform(*_DIG_STEP)), 0.5 * stroke))
            self.rest(float(random.uniform(0.2, 0.8)))
        self.digging.append((began, self.time))
        self.load(self.drawn(use.full), 0.5)
        if random.random() < use.ends:
            self.go(stroke * (1.0 + _BEYOND), press=float(random.uniform(0.3, 5.0)))
            self.height = stroke
        else:
            self.go(stroke * float(random.uniform(*use.high)))
        self.rest()
        self.go(stroke * float(random.uniform(*use.high)))
        self.load(self.drawn(use.empty), float(random.uniform(0.5, 1.5)))
        self.rest()


def loader_work(
    unit: HydraulicUnit,
    kind: str,
    oil_temperature: float,
    *,
    duration: float = 360.0,
    start_position: float | None = None,
    seed: int = 0,
) -> Duty:
    """Work of a loader's cylinder, other than any before with each seed.

    Args:
        kind: a name of `USES`.
        oil_temperature: [K].
        duration: time after which no further cycle begins [s].
        start_position: [m]; by default a fifth of the stroke above the lowered end.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> work = loader_work(boom, "loader-boom", 313.15, duration=120.0)
        >>> work.duration > 120.0
        True
    """
    random = np.random.default_rng(seed)
    stroke, lift = unit.cylinder.stroke, unit.lift_sign
    start = (0.2 * stroke if lift > 0.0 else 0.8 * stroke) if start_position is None else start_position
    course = _Course(unit, USES[kind], start if lift > 0.0 else stroke - start, oil_temperature, random)
    course.rest(1.0)
    while course.time < duration:
        course.cycle()
    corners = {round(t, 6): value for t, value in course.speeds}
    time, load = _with_noise(course, random)
    speeds = Profile(list(corners), list(corners.values()))
    return as_driven(unit, Duty(speeds, Profile(time, load), constant(oil_temperature), start, end=course.time))


def _with_noise(course: _Course, random: np.random.Generator) -> tuple[Array, Array]:
    """The load with what ground and engine make of it faster than 0.5 Hz, more of it while it digs."""
    time = np.arange(0.0, course.time + _STEP, _STEP)
    at, value = (np.array(one) for one in zip(*course.loads, strict=True))
    base = np.interp(time, at, value)
    white = random.standard_normal(time.size)
    slow = np.zeros_like(white)
    share = _STEP / (_CORNER + _STEP)
    for k in range(1, time.size):
        slow[k] = slow[k - 1] + share * (white[k] - slow[k - 1])
    fast = white - slow
    digs = np.zeros(time.size, dtype=bool)
    for begins, ends in course.digging:
        digs |= (time >= begins) & (time <= ends)
    corners, speeds = (np.array(one) for one in zip(*course.speeds, strict=True))
    moves = np.abs(np.interp(time, corners, speeds)) > 0.0
    size = np.where(digs, _DIGGING, np.where(moves, _NOISE, 0.0)) * course.relief / fast.std()
    return time, np.clip(base + size * fast, _LEAST * course.relief, _MOST * course.relief)
