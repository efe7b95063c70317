"""A run of a linked machine that lifts: what a weighing in C is compared on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.drive_report import reported, usual_report
from ramsight.duty.linked_duty import LinkedDuty, simulated_linked
from ramsight.duty.profile import Profile, constant
from ramsight.engine.recursion import replay
from ramsight.engine.typed_state import initial_values
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.kalman import kalman
from ramsight.signals import Signal, Signals
from ramsight.tool.lift_values import QUALITIES
from ramsight.tool.weigher import law_of, plain_of, rows_of
from ramsight.tool.weighing_events import Scene
from ramsight.tool.weighing_tally import Tally

_TEMPERATURE = 313.15  # K
_START, _LIFTED = 0.2, 0.35  # of the stroke: where the lifts begin, and how far they go
_RAMP, _REST, _LASTS = 0.3, 0.8, 3.7  # s
_MOTIONS = ((1.0, _LASTS), (-1.0, _LASTS), (1.0, _LASTS), (1.0, 0.5), (-1.0, _LASTS))
"""Direction of each motion and for how long it is at full speed [s]: a load lifted and lowered again, one of which some
is spilled, one that is too short, and the tool lowered at a place that is not known."""
_CARRIED = (0.5, 0.5, 0.9, 0.7, 0.0)  # of the rated payload
_SPILLED = 0.2  # of the same, within the third motion
_KNOWN_STD = 1e-3  # m


@dataclass(frozen=True)
class GoldenWeighing:
    """Samples, and what Python weighs of them."""

    rows: Array  # inputs of the recursion, shape (samples, inputs)
    weighed: Array  # of each weighing, shape (weighings, columns of `WEIGHED`)


WEIGHED = (
    "sample", "new", "quality", "count", "cycle", "cycles", "mass [kg]", "half band [kg]", "total [kg]",
    "its half band [kg]", "share of the rated load",
)  # fmt: skip
"""Columns of what was weighed."""


def golden_weighing(scene: Scene, tally: Tally) -> GoldenWeighing:
    """Lifts of a scene's machine, and what they weigh by a tally."""
    machine, name = scene.machine, scene.unit
    duty = _duty(scene)
    run = simulated_linked(machine, duty).columns()
    time = run["time"].values
    own = {one: run[f"{name}_{one}"] for one in ("motor_speed", "motor_torque", "oil_temperature")}
    unit = machine.unit(name)
    log = reported(Signals({"time": Signal(time), **own}), usual_report(unit))
    sensor = kalman(unit)
    sensor.start(duty.start_position[name], _KNOWN_STD)
    rows = rows_of(scene, sensor.followed(log))
    law = law_of(scene)
    rows[rows[:, law.recursion.inputs.index("time")] > duty.phases[-1][1], 0] = math.nan  # of the mechanism's first
    said = replay(law.recursion, rows, np.array([scene.inclination]), initial_values(law.initial))
    weighed = []
    for place in np.flatnonzero(said[:, 0] > 0.0):
        one = tally.add(plain_of(law, said[place].tolist()))
        if one is not None:
            total = tally.total
            weighed.append(
                (
                    float(place), 1.0 if one.direction == "up" else 2.0, float(QUALITIES.index(one.quality)),
                    float(tally.count), float(one.cycle), float(total.cycles), one.mass, TWO_SIDED_95 * one.std,
                    total.mass, TWO_SIDED_95 * total.std(tally.scale), one.rated_share,
                )
            )  # fmt: skip
    return GoldenWeighing(rows, np.array(weighed))


def _duty(scene: Scene) -> LinkedDuty:
    machine, name = scene.machine, scene.unit
    unit, rated = machine.unit(name), scene.rated
    half = {one.name: 0.5 * one.cylinder.stroke for one in machine.units}
    share = _START if unit.lift_sign > 0.0 else 1.0 - _START
    fastest = _LIFTED * unit.cylinder.stroke / (_LASTS + _RAMP) / float(unit.travel_per_radian)
    top = unit.lift_sign * min(0.6 * unit.max_speed, fastest)
    time, speeds, loads, phases = 0.0, [(0.0, 0.0)], [(0.0, 0.0)], []
    for k, ((direction, lasts), carried) in enumerate(zip(_MOTIONS, _CARRIED, strict=True)):
        loads += [(time + 0.2 * _REST, loads[-1][1]), (time + 0.6 * _REST, carried * rated)]
        time += 1.5 * _REST
        phases.append((f"motion {k + 1}", time - 0.5 * _REST))
        corners = ((0.0, 0.0), (_RAMP, 1.0), (_RAMP + lasts, 1.0), (2.0 * _RAMP + lasts, 0.0))
        speeds += [(time + after, direction * value * top) for after, value in corners]
        if k == 2:
            at = time + 0.6 * lasts
            loads += [(at, carried * rated), (at + 0.2, (carried - _SPILLED) * rated)]
        time += 2.0 * _RAMP + lasts
    time += _REST
    return LinkedDuty(
        motor_speed={
            name: Profile(*np.array([*speeds, (time, 0.0)]).T),
            **{o: constant(0.0) for o in half if o != name},
        },
        oil_temperature=dict.fromkeys(half, constant(_TEMPERATURE)),
        start_position=half | {name: share * unit.cylinder.stroke},
        payload=Profile(*np.array([*loads, (time, loads[-1][1])]).T),
        end=time,
        phases=tuple(phases),
    )
