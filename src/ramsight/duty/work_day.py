"""A work day: random moves and loads, with a visit to an end stop now and then."""

from __future__ import annotations

import math

import numpy as np

from ramsight.duty.plan import as_driven
from ramsight.duty.profile import Duty, Profile, constant
from ramsight.plant.unit import HydraulicUnit
from ramsight.units import RPM

_SPEEDS = np.array([400.0, 800.0, 1000.0, 1200.0, 1500.0, 1800.0, 2200.0]) * RPM
_RAMPS = (1000.0 * RPM, 4000.0 * RPM)  # rad/s2, least and greatest
_RESTS = (1.0, 4.0)  # s
_LOAD_RAMP = 0.4  # s
_LOAD_CHANGES = 0.5  # chance at each rest
_BEYOND = 0.3  # share of the stroke by which the command of a visit to a stop goes beyond it: pressed for some seconds
_INSIDE = (0.1, 0.9)  # share of the stroke that other moves stay within


def work_day(
    unit: HydraulicUnit,
    loads: tuple[float, float],
    oil_temperature: float,
    *,
    duration: float = 360.0,
    visit_every: float = 45.0,
    start_position: float | None = None,
    seed: int = 0,
) -> Duty:
    """Random moves with load changes at rest and visits to the end stops.

    The commands are made as an operator's are: from where the rod would be by the pump's displacement and a leakage
    of a tenth of its flow; where it really gets to is the simulation's affair.

    Args:
        unit: the unit that works.
        loads: least and greatest load [N], positive against lifting.
        oil_temperature: [K].
        duration: time after which no further move begins [s].
        visit_every: time after the last visit from which the next move goes to a stop [s].
        start_position: [m]; by default a fifth of the stroke above the lowered end.
        seed: the same seed gives the same day.
    """
    random = np.random.default_rng(seed)
    stroke, lift = unit.cylinder.stroke, unit.lift_sign
    start = (0.2 * stroke if lift > 0.0 else 0.8 * stroke) if start_position is None else start_position
    height = start if lift > 0.0 else stroke - start  # above the lowered end
    speed, load = [(0.0, 0.0), (1.0, 0.0)], [(0.0, float(random.uniform(*loads)))]
    visited = 0.0
    while speed[-1][0] < duration:
        now = speed[-1][0]
        if visit := now - visited > visit_every:
            target = 0.0 if random.random() < height / stroke else stroke
        else:
            target = float(random.uniform(*_INSIDE)) * stroke
        distance, up = abs(target - height) + (_BEYOND * stroke if visit else 0.0), 1.0 if target > height else -1.0
        fastest, slope = float(random.choice(_SPEEDS)), float(random.uniform(*_RAMPS))
        per_angle = unit.travel_per_radian * (1.0 - 0.1 * up)
        angle = distance / per_angle
        top = min(fastest, math.sqrt(angle * slope))
        ramp = top / slope
        for at, value in ((ramp, top), (ramp + angle / top - ramp, top), (ramp + angle / top, 0.0)):
            speed.append((now + at, up * lift * value))
        height = target
        rest = float(random.uniform(*_RESTS))
        stopped = speed[-1][0]
        speed.append((stopped + rest, 0.0))
        if visit:
            visited = stopped
        if random.random() < _LOAD_CHANGES:
            load += [(stopped + 0.5, load[-1][1]), (stopped + 0.5 + _LOAD_RAMP, float(random.uniform(*loads)))]
    corners = {round(t, 6): value for t, value in speed}
    duty = Duty(
        Profile(list(corners), list(corners.values())),
        Profile([t for t, _ in load], [value for _, value in load]),
        constant(oil_temperature),
        start,
        end=speed[-1][0],
    )
    return as_driven(unit, duty)
