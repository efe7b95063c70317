"""A duty for a motor that turns one way, its directional valve commanded to where the speed's sign would have led."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ramsight.duty.profile import Duty, Profile
from ramsight.plant.directional import DirectionalValve
from ramsight.plant.unit import HydraulicUnit


def as_driven(unit: HydraulicUnit, duty: Duty) -> Duty:
    """A duty as a unit's motor turns it: forward only where a directional valve is commanded."""
    for part in unit.parts():
        if isinstance(part, DirectionalValve) and part.name not in duty.commands:
            duty = one_way(duty, part.name)
    return duty


def one_way(duty: Duty, valve: str) -> Duty:
    """The same moves by a motor that only turns forward.

    Args:
        duty: whose motor speed changes its sign at rest only, positive extending.
        valve: the part that is commanded: 1 where the duty extends, -1 where it retracts, before each move.

    Raises:
        ValueError: the speed passes through zero between two corners.

    Example:
        >>> from ramsight.duty.profile import constant
        >>> speed = Profile([0, 1, 2, 3, 4, 5], [0, 0, 100, 0, 0, -50])
        >>> forward = one_way(Duty(speed, constant(0.0), constant(313.15), 0.1), "valve")
        >>> forward.motor_speed.value.tolist(), forward.commanded("valve", [0.0, 1.5, 4.5]).tolist()
        ([0.0, 0.0, 100.0, 0.0, 0.0, 50.0], [1.0, 1.0, -1.0])
    """
    time, value = duty.motor_speed.time, duty.motor_speed.value
    if np.any(value[1:] * value[:-1] < 0.0):
        raise ValueError("the speed changes its sign between two corners; put one at zero")
    way = np.sign(np.concatenate([value[1:] + value[:-1], value[-1:]]))
    known = np.flatnonzero(way)
    at, ways = time[known], way[known]
    changes = np.concatenate([[True], ways[1:] != ways[:-1]]) if len(known) else np.zeros(0, dtype=bool)
    at, ways = at[changes], ways[changes]
    if len(at):  # the first way holds from the beginning
        at[0] = min(float(at[0]), 0.0)
    commands = {valve: Profile(at, ways) if len(at) else Profile([0.0], [1.0])}
    return replace(duty, motor_speed=Profile(time, np.abs(value)), commands={**duty.commands, **commands})
