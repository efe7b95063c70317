"""A loader's mechanism at work: a loading cycle, and a shift of lifts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ramsight.duty.lift_lower import RAMP
from ramsight.duty.linked_duty import LinkedDuty
from ramsight.duty.profile import Profile, constant
from ramsight.plant.linkage import holding_forces, joints
from ramsight.plant.linked import LinkedMachine
from ramsight.plant.steady import torque_at_load
from ramsight.units import RPM

SPEEDS: Mapping[str, float] = {"boom": 2400 * RPM, "bucket": 1500 * RPM}
"""Motor speeds of the moves [rad/s], [G]: the whole lift takes about 17 s, the bucket's whole way about 7 s."""


@dataclass(frozen=True)
class Phase:
    """A part of the cycle: where the rods go, and what the heap does meanwhile."""

    name: str
    # boom, bucket: share of the stroke to go to; where it is if omitted
    boom: float | None = None
    bucket: float | None = None
    payload: float = 0.0  # share of the rated payload at its end, reached evenly
    tip_force: tuple[float, float] = (0.0, 0.0)  # of the heap on the lip at its end, forward and up [N], reached evenly
    rest: float = 0.5  # time after the moves [s]


# Shares of the strokes of the catalogue's loader, where a half is a level bucket. [G] forces and times: the heap pushes
# back with about a third of what the boom can lift, as long as the bucket fills.
PHASES = (
    Phase("approach", rest=2.0),
    Phase("crowd", bucket=0.36, payload=0.5, tip_force=(-40e3, -10e3)),
    Phase("fill", boom=0.12, bucket=0.24, payload=1.0, tip_force=(-20e3, -5e3)),
    Phase("break out", boom=0.2, bucket=0.1, payload=1.0),
    Phase("travel", payload=1.0, rest=6.0),
    Phase("lift", boom=0.88, payload=1.0, rest=1.5),
    Phase("tip", bucket=0.5, payload=1.0, rest=0.0),
    Phase("dump", bucket=0.9, payload=0.0, rest=1.5),
    Phase("level", bucket=0.5),
    Phase("lower", boom=0.05, rest=2.0),
)
_START = {"boom": 0.05, "bucket": 0.5}


def loading_cycle(
    machine: LinkedMachine,
    *,
    payload: float | None = None,
    oil_temperature: float = 313.15,
    speeds: Mapping[str, float] = SPEEDS,
    ramp: float = RAMP,
) -> LinkedDuty:
    """One loading cycle of a machine with the units "boom" and "bucket".

    Moves are planned as an operator's eye would: with the leakage that steady motion has under the load that the
    mechanism puts on the rods midway, so that they end near where they should.

    Args:
        machine: the loader.
        payload: in the full bucket [kg]; the rated one if omitted.
        oil_temperature: of both units [K].
        speeds: of the motors, by unit [rad/s].
        ramp: time of each speed ramp [s].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.linked import build_linked
        >>> duty = loading_cycle(build_linked(machine.load_machine("mining-loader")))
        >>> [name for name, _ in duty.phases][:4]
        ['approach', 'crowd', 'fill', 'break out']
    """
    full = machine.mechanism.rated_payload if payload is None else payload
    stroke = {unit.name: unit.cylinder.stroke for unit in machine.units}
    start = {name: share * stroke[name] for name, share in _START.items()}
    now, carried, time = dict(start), 0.0, 0.0
    speed = {name: [(0.0, 0.0)] for name in start}
    works = [(0.0, 0.0, 0.0, 0.0)]
    phases = []
    for phase in PHASES:
        phases.append((phase.name, time))
        asked = {"boom": phase.boom, "bucket": phase.bucket}
        goals = {name: stroke[name] * share for name, share in asked.items() if share is not None}
        longest = 0.0
        for name, goal in goals.items():
            after = {**now, **goals}
            travel = travel_midway(
                machine, name, now, after, 0.5 * (carried + phase.payload) * full, oil_temperature, speeds
            )
            way = goal - now[name]
            hold = max(abs(way) / (speeds[name] * travel) - ramp, 0.0)
            peak = np.sign(way) * min(speeds[name], abs(way) / (travel * ramp))
            corners = ((time, 0.0), (time + ramp, peak), (time + ramp + hold, peak), (time + 2 * ramp + hold, 0.0))
            speed[name] += [corner for corner in corners if corner[0] > speed[name][-1][0]]
            longest = max(longest, 2 * ramp + hold)
        now |= goals
        carried = phase.payload
        time += longest + phase.rest
        works.append((time - 0.5 * phase.rest, full * carried, *phase.tip_force))
    table = np.array(works)
    return LinkedDuty(
        motor_speed={name: Profile(*np.array([*corners, (time, 0.0)]).T) for name, corners in speed.items()},
        oil_temperature=dict.fromkeys(start, constant(oil_temperature)),
        start_position=start,
        payload=Profile(table[:, 0], table[:, 1]),
        tip_force_x=Profile(table[:, 0], table[:, 2]),
        tip_force_z=Profile(table[:, 0], table[:, 3]),
        end=time,
        phases=tuple(phases),
    )


def travel_midway(
    machine: LinkedMachine,
    name: str,
    now: Mapping[str, float],
    after: Mapping[str, float],
    payload: float,
    oil_temperature: float,
    speeds: Mapping[str, float],
) -> float:
    """Travel per motor angle [m/rad] on the way, at the load that there is midway."""
    unit = machine.unit(name)
    middle = [0.5 * (now[other.name] + after[other.name]) for other in machine.units]
    forces = holding_forces(machine.mechanism, joints(machine.mechanism, middle), payload)
    load = unit.lift_sign * float(forces[machine.units.index(unit)])
    point = torque_at_load(unit, max(load, 0.0), oil_temperature, speeds[name])
    lifts = (after[name] - now[name]) * unit.lift_sign > 0.0
    return float(point.travel_lift if lifts else point.travel_lower)


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
