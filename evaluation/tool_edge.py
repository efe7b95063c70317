"""Where the edge of a loader's bucket is: drawn machines at work after both units have met both ends.

Machines are drawn as in weighing.py. Each begins at an unknown place, meets both ends of either cylinder twice, and
does a loading cycle. Both units are tracked by what their drives report; the edge follows from the described mechanism.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import weighing
from weighing import OTHER, UNIT

from ramsight.duty.linked_duty import LinkedDuty, simulate_linked, unit_run
from ramsight.duty.loading import loading_cycle
from ramsight.duty.profile import Profile, constant
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.kalman import kalman
from ramsight.signals import Signal, Signals
from ramsight.tool.tool_place import place_of
from ramsight.tool.unit_tracks import Others
from ramsight.units import RPM

MACHINES = 20
SPEED, RAMP = 1500.0 * RPM, 0.5
_BEYOND = 1.25  # of the time that a stroke takes, so that the piston presses on its end
_STARTS = {UNIT: 0.25, OTHER: 0.25}
Random = np.random.Generator


def visits(name: str, to: float) -> list[tuple[float, float]]:
    """Speeds of a unit over time that meet both its ends twice and stop at a place [m]."""
    unit = weighing.described().unit(name)
    whole = unit.cylinder.stroke / (SPEED * float(unit.travel_per_radian))
    speed, time = [(0.0, 0.0)], 1.0
    ways = [(-1.0, whole), (1.0, whole), (-1.0, whole), (1.0, whole), (-1.0, whole)]
    for sign, span in [*((s, _BEYOND * t) for s, t in ways), (1.0, to / unit.cylinder.stroke * whole - RAMP)]:
        corners = ((0.0, 0.0), (RAMP, sign * SPEED), (RAMP + span, sign * SPEED), (2 * RAMP + span, 0.0))
        speed += [(time + after, value) for after, value in corners]
        time += 2 * RAMP + span + 1.0
    return [*speed, (time, 0.0)]


def duty_of(kelvin: float) -> tuple[LinkedDuty, float]:
    """Visits of the bucket, then of the boom, then work; and when the work begins [s]."""
    work = loading_cycle(weighing.described())
    bucket = visits(OTHER, work.start_position[OTHER])
    boom = [(t + bucket[-1][0], v) for t, v in visits(UNIT, work.start_position[UNIT])]
    begins = boom[-1][0]
    speeds = {}
    for name, before in ((UNIT, boom), (OTHER, bucket)):
        after = work.motor_speed[name]
        rows = [(0.0, 0.0), *before, *zip(after.time + begins + 1e-3, after.value, strict=True)]
        kept = [row for k, row in enumerate(rows) if k == 0 or row[0] > rows[k - 1][0]]
        speeds[name] = Profile(*np.array(kept).T)
    shifted = [Profile([0.0, *(one.time + begins + 1e-3)], [0.0, *one.value]) for one in work.works]
    duty = LinkedDuty(speeds, dict.fromkeys(_STARTS, constant(kelvin)), _STARTS, *shifted, end=begins + work.duration)
    return duty, begins


def of_machine(seed: int) -> dict[str, Any]:
    """Errors of the edge at work, and its deviations [m]."""
    one = weighing.made(seed)
    duty, begins = duty_of(one.temperature)
    level = replace(one.grounds[0], mechanism=replace(weighing.described().mechanism, bodies=one.bodies))
    run = simulate_linked(level, duty)
    time, tracks = run["time"].values, {}
    for name, drawn in one.drawn.items():
        part = unit_run(run, name)
        names = ("motor_speed", "motor_torque", "oil_temperature")
        reported = drawn.reported(time, *(part[key].values for key in names), seed)
        sensor = kalman(weighing.described().unit(name))
        sensor.start(None)
        columns = {key: Signal(values) for key, values in zip(names, reported, strict=True)}
        tracks[name] = sensor.followed(Signals({"time": Signal(time), **columns}))
    rods = Others({OTHER: tracks[OTHER]}).rods(weighing.described(), UNIT, tracks[UNIT])
    mechanism = weighing.described().mechanism
    strokes = np.array([unit.cylinder.stroke for unit in weighing.described().units])
    place = place_of(mechanism, mechanism.tip, rods.position, rods.std, strokes)
    works = time > begins
    found = {"known": float(np.mean(np.isfinite(place.value["height"][works])))}
    for axis, truth in (("height", "tip_z"), ("reach", "tip_x")):
        error = np.abs(place.value[axis] - run[truth].values)[works]
        std = place.std[axis][works]
        seen = np.isfinite(error)
        found |= {f"{axis}_error": error[seen], f"{axis}_inside": error[seen] <= TWO_SIDED_95 * std[seen]}
    for name in tracks:
        off = np.abs(tracks[name]["position"].values - unit_run(run, name)["position"].values)[works]
        found[f"{name}_error"] = off[np.isfinite(off)]
    return found


def runs() -> int:
    """How many machines there are."""
    return MACHINES


def study(advance: Callable[[int], object]) -> dict[str, Any]:
    """Errors by axis, over all machines' work."""
    machines = []
    for seed in range(MACHINES):
        machines.append(of_machine(seed))
        advance(1)
    found: dict[str, Any] = {"machines": MACHINES, "known": float(np.mean([one["known"] for one in machines]))}
    for axis in ("height", "reach"):
        p95 = [float(np.quantile(one[f"{axis}_error"], 0.95)) for one in machines if len(one[f"{axis}_error"])]
        inside = np.concatenate([one[f"{axis}_inside"] for one in machines])
        found[axis] = {"p95_median": float(np.median(p95)), "p95_worst": max(p95), "coverage": float(inside.mean())}
    return found


def table(found: dict[str, Any]) -> list[str]:
    """An axis a row."""
    rows = ["| edge of the bucket | 95 % error, median machine, worst | band holds |", "|---|---|---|"]
    return rows + [
        f"| {axis} | {1e3 * found[axis]['p95_median']:.0f} mm, {1e3 * found[axis]['p95_worst']:.0f} mm "
        f"| {100 * found[axis]['coverage']:.0f} % |"
        for axis in ("height", "reach")
    ]
