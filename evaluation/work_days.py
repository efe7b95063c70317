"""How good the kalman sensor is on machines that are not their data sheet: work days of machines drawn at random.

Leakage ±25 %, displacement ±0.5 %, stiffness ±40 %, friction ±40 %, oil temperature ±3 K off, torque ±3 % off; moves,
loads at rest and visits to end stops at random, no switch. The seed decides everything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray
from judged_errors import turning_for
from numpy.typing import NDArray

from ramsight import machine
from ramsight.arrays import true_intervals
from ramsight.duty import report, simulate
from ramsight.duty.drive_report import declared_report
from ramsight.duty.work_day import work_day
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.ddh import DdhUnit, build_ddh
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.tracking.track_errors import stop_visits

LOADS = {"boom": (100e3, 370e3), "bucket": (20e3, 140e3)}  # N
_STARTS = 0.5  # s after the motor has started, from when on the position counts
_PASSES = 1e-7  # m3/s
_JUST_NOW = 50  # samples
_GENTLE = (Status.OK, Status.REFERENCE_DUE, Status.NEAR_RELIEF, Status.TOO_UNCERTAIN)
"""What a healthy machine may be told without it being a false alarm: doubts of the position, not of an input."""


def drawn_machine(random: np.random.Generator) -> AsBuilt:
    """A machine within its tolerances."""
    return AsBuilt(
        leak=random.uniform(0.75, 1.25),
        displacement=random.uniform(0.995, 1.005),
        stiffness=random.uniform(0.6, 1.4),
        friction=random.uniform(0.6, 1.4),
    )


def reported(run: xarray.Dataset, unit: HydraulicUnit, seed: int, random: np.random.Generator) -> xarray.Dataset:
    """What the unit's drive reports of a run, with a torque and a temperature that are off."""
    log = report(run, declared_report(unit, seed))
    log["motor_torque"] *= random.uniform(0.97, 1.03)
    log["oil_temperature"] += random.uniform(-3.0, 3.0)
    return log


def passes_relief(run: xarray.Dataset) -> NDArray[np.bool_]:
    """Where oil passes a relief valve."""
    return (run["relief_a_flow"].values > _PASSES) | (run["relief_b_flow"].values > _PASSES)


@dataclass(frozen=True)
class Day:
    """One machine's day: what its drive reported, and what was true."""

    unit: DdhUnit
    log: xarray.Dataset
    position: NDArray[np.float64]
    relief: NDArray[np.bool_]
    start: float


def data_sheets() -> dict[str, DdhUnit]:
    """The loader's units."""
    loader = machine.load_machine("mining-loader")
    return {name: build_ddh(name, loader.unit(name)) for name in LOADS}


def drawn(unit: DdhUnit, seed: int, duration: float = 360.0, *, one_load: bool = False) -> Day:
    """A day of a machine drawn by its seed; its drive reports what the unit declares."""
    random = np.random.default_rng([seed, sorted(LOADS).index(unit.name)])
    built = drawn_machine(random)
    gain, off = random.uniform(0.97, 1.03), random.uniform(-3.0, 3.0)
    least, most = LOADS[unit.name]
    loads = (0.5 * (least + most),) * 2 if one_load else (least, most)
    duty = work_day(unit, loads, random.uniform(298.15, 328.15), duration=duration, seed=seed)
    run = simulate(built.apply(unit), duty)
    log = report(run, declared_report(unit, seed))
    log["motor_torque"] *= gain
    log["oil_temperature"] += off
    return Day(unit, log, run["position"].values, passes_relief(run), duty.start_position)


def days(
    machines: int, keys: Mapping[str, float], advance: Callable[[int], object], *, one_load: bool = False
) -> Iterator[tuple[VirtualSensor, Day, int]]:
    """Days of machines drawn, half of them of each unit, with the sensor that has these assumptions; and their seeds.

    `advance` is told of each that is done.
    """
    for plain in data_sheets().values():
        unit = replace(plain, assumptions=plain.assumptions.replace(dict(keys)))
        sensor = kalman(unit)
        for seed in range(machines // 2):
            yield sensor, drawn(unit, seed, one_load=one_load), seed
            advance(1)


def study(machines: int, advance: Callable[[int], object]) -> dict[str, dict[str, float]]:
    """The figures of each unit, over so many machines."""
    found = {}
    for name, unit in data_sheets().items():
        sensor = kalman(unit)
        p95, largest, inside, wrong, samples, hours, alarms = [], [], 0, 0, 0, 0.0, 0
        for seed in range(machines):
            day = drawn(unit, seed)
            sensor.start(day.start)
            track = sensor.track(day.log)
            error = np.abs(track["position"].values - day.position)
            std, status = track["position_std"].values, track["status"].values
            time = day.log["time"].values
            stops = stop_visits(time, day.position, unit.cylinder.stroke)
            inside += int((error <= TWO_SIDED_95 * std).sum())
            wrong += int(((status == Status.OK) & (error > 4.0 * std)).sum())
            samples, hours = samples + len(time), hours + (time[-1] - time[0]) / 3600.0
            begins = [first for first, _ in true_intervals(~np.isin(status, _GENTLE))]
            # Oil that has passed the relief valve is lost indeed.
            alarms += sum(
                status[k] != Status.POSITION_LOST or not day.relief[max(k - _JUST_NOW, 0) : k + 1].any() for k in begins
            )
            if len(stops) > 3:
                judged = (time > stops[2] + 1.0) & (turning_for(time, day.log["motor_speed"].values) > _STARTS)
                p95.append(float(np.percentile(error[judged], 95.0)))
                largest.append(float(error[judged].max()))
            advance(1)
        found[name] = {
            "machines": machines,
            "judged": len(p95),
            "p95_median_mm": 1e3 * float(np.median(p95)),
            "p95_worst_mm": 1e3 * max(p95),
            "largest_median_mm": 1e3 * float(np.median(largest)),
            "largest_worst_mm": 1e3 * max(largest),
            "p95_within_3_mm": float(np.mean(np.array(p95) <= 3e-3)),
            "largest_within_8_mm": float(np.mean(np.array(largest) <= 8e-3)),
            "band_holds": inside / samples,
            "ok_beyond_4_std": wrong / samples,
            "hours": hours,
            "false_alarms_per_100_h": 100.0 * alarms / hours,
        }
    return found
