"""A shift of lifts: take up a mass, lift it, dump it, and lower the empty tool again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ramsight.duty.linked_duty import LinkedDuty
from ramsight.duty.loading import travel_midway
from ramsight.duty.profile import Profile, constant
from ramsight.plant.linked import LinkedMachine
from ramsight.units import RPM

LOW, HIGH = 0.1, 0.6
"""Shares of the stroke between which it is lifted, from the lowered end."""
_RAMP, _LOADS, _RESTS = 0.5, 1.0, 1.0  # s


def lifting(
    machine: LinkedMachine,
    masses: Sequence[float],
    *,
    unit: str | None = None,
    oil_temperature: float = 313.15,
    speed: float = 2400 * RPM,
) -> LinkedDuty:
    """One lift of each mass; the other units stand still at half their strokes.

    Args:
        machine: with a mechanism that has a payload.
        masses: in order [kg].
        unit: that lifts; by default the mechanism's first.
        oil_temperature: of all units [K].
        speed: of the motor [rad/s].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.linked import build_linked
        >>> duty = lifting(build_linked(machine.load_machine("mining-loader")), [2000.0, 3000.0])
        >>> float(duty.payload.value.max()), [name for name, _ in duty.phases]
        (3000.0, ['lift', 'dump', 'lift', 'dump'])
    """
    name = machine.mechanism.cylinders[0] if unit is None else unit
    half = {one.name: 0.5 * one.cylinder.stroke for one in machine.units}
    lifts = machine.unit(name)
    low, high = (lifts.cylinder.stroke * (share if lifts.lift_sign > 0.0 else 1.0 - share) for share in (LOW, HIGH))
    speeds, loads, time, phases = [(0.0, 0.0)], [(0.0, 0.0)], 0.0, []
    every = dict.fromkeys(half, speed)
    for mass in masses:
        for goal, now, carried in ((high, low, mass), (low, high, 0.0)):
            loads += [(time + _RESTS, loads[-1][1]), (time + _RESTS + _LOADS, carried)]
            time += 2.0 * _RESTS + _LOADS
            phases.append(("lift" if goal == high else "dump", time))
            travel = travel_midway(
                machine, name, half | {name: now}, half | {name: goal}, carried, oil_temperature, every
            )
            hold = max(abs(goal - now) / (speed * travel) - _RAMP, 0.0)
            top = np.sign(goal - now) * speed
            corners = ((0.0, 0.0), (_RAMP, top), (_RAMP + hold, top), (2.0 * _RAMP + hold, 0.0))
            speeds += [(time + after, value) for after, value in corners]
            time += 2.0 * _RAMP + hold
    time += _RESTS
    still = {one: constant(0.0) for one in half if one != name}
    return LinkedDuty(
        motor_speed={name: Profile(*np.array([*speeds, (time, 0.0)]).T), **still},
        oil_temperature=dict.fromkeys(half, constant(oil_temperature)),
        start_position=half | {name: low},
        payload=Profile(*np.array([*loads, (time, 0.0)]).T),
        end=time,
        phases=tuple(phases),
    )
