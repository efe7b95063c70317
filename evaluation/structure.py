"""Machines with random structure: circuits, geometry, drives and laws that the sensor does not have; a day each."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import xarray
from circuits import CIRCUITS, catalogued
from judged_errors import Judged, judge

from ramsight.duty import DriveReport, Profile, report, simulate
from ramsight.duty.work_day import work_day
from ramsight.plant.accumulator import Accumulator
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.hose import Hose, Volume
from ramsight.plant.limits import limits_of
from ramsight.plant.pump import Pump
from ramsight.plant.valve import CheckValve, Orifice, ReliefValve, SafetyValve
from ramsight.sensor.kalman import kalman

LAWS = ("as described", "drag", "orifice leakage", "free air", "seal leakage", "warming", "coarse drive")
_DAY = 300.0  # s
_SMALLEST, _LARGEST = -1.0, 1.0  # natural logarithm of the scale of areas; strokes scale apart from it


def scaled(unit: Any, size: float, length: float) -> Any:
    """The unit with areas and pumps `size` times as large and a stroke `length` times as long."""
    volume = size * length

    def part(p: Any) -> Any:
        if isinstance(p, Pump):
            return replace(p, displacement=p.displacement * size, no_load_torque=p.no_load_torque * size)
        if isinstance(p, Volume):
            return replace(p, volume=p.volume * volume)
        if isinstance(p, Hose):
            return replace(p, volume=p.volume * volume, diameter=p.diameter * math.sqrt(size))
        if isinstance(p, Accumulator):
            return replace(p, volume=p.volume * volume)
        if isinstance(p, CheckValve | Orifice | SafetyValve | ReliefValve):
            return replace(p, conductance=p.conductance * size)
        return replace(p, conductance=p.conductance * size) if hasattr(p, "conductance") else p

    c = unit.cylinder
    cylinder = replace(
        c,
        area_a=c.area_a * size,
        area_b=c.area_b * size,
        stroke=c.stroke * length,
        dead_volume_a=c.dead_volume_a * volume,
        dead_volume_b=c.dead_volume_b * volume,
        mass=c.mass * size,
        coulomb_friction=c.coulomb_friction * size,
        breakaway_friction=c.breakaway_friction * size,
        viscous_friction=c.viscous_friction * size,
        stop_stiffness=c.stop_stiffness * size,
    )
    drive = replace(unit.drive, inertia=unit.drive.inertia * size)
    return replace(unit.mapped(part), cylinder=cylinder, drive=drive)


def day(circuit: str, law: str, seed: int) -> Judged:
    """One machine's day, judged after the third visit to a stop."""
    random = np.random.default_rng([seed, sorted(CIRCUITS).index(circuit), LAWS.index(law)])
    size, length = math.exp(random.uniform(_SMALLEST, _LARGEST)), math.exp(random.uniform(-0.7, 0.7))
    unit = scaled(catalogued(*CIRCUITS[circuit]), size, length)
    built = AsBuilt(
        leak=random.uniform(0.8, 1.25),
        displacement=random.uniform(0.995, 1.005),
        stiffness=random.uniform(0.7, 1.3),
        friction=random.uniform(0.7, 1.3),
    ).apply(unit)
    limits = limits_of(unit)
    if law == "orifice leakage":
        built = built.mapped(
            lambda p: (
                replace(p, orifice_leak=0.3 * 0.1 * p.displacement * p.nominal_speed / math.sqrt(250e5))
                if isinstance(p, Pump)
                else p
            )
        )
    if law == "free air":
        built = replace(built, oil=replace(built.oil, air=0.005, polytropic=1.4))
    if law == "seal leakage":
        leak = 0.02 * limits.leak_velocity * float(unit.cylinder.area(unit.held)) / limits.pressure * 32e-6
        built = replace(built, cylinder=replace(built.cylinder, seal_leak=leak))
    loads = (0.1 * limits.load, 0.6 * limits.load)
    duty = work_day(unit, loads, 313.15, duration=_DAY, visit_every=45.0, seed=seed)
    if law == "warming":
        end = duty.duration
        duty = replace(duty, oil_temperature=Profile([0.0, end], [308.15, 308.15 + 4.0 * end / 60.0]))
    period = 0.05 if law == "coarse drive" else 0.02
    run = simulate(built, duty, sample_period=period)
    log = reported(run, law, limits.torque, seed)
    sensor = kalman(unit)
    sensor.start(duty.start_position)
    track = sensor.track(log)
    return judge(track, log["motor_speed"].values, run["position"].values, unit.cylinder.stroke)


def reported(run: xarray.Dataset, law: str, torque: float, seed: int) -> xarray.Dataset:
    """What the drive reports of it."""
    coarse = 2.0 if law == "coarse drive" else 1.0
    if law == "drag":
        speed = run["motor_speed"].values
        run["motor_torque"].values[:] += 0.015 * torque * speed / 157.0 + 0.005 * torque * np.tanh(speed / 3.0)
    if law == "warming":  # a thermometer in the tank is a minute behind
        time, oil = run["time"].values, run["oil_temperature"].values.copy()
        run["oil_temperature"].values[:] = np.interp(time - 60.0, time, oil)
    how = DriveReport(torque_step=coarse * torque / 1300.0, torque_noise=coarse * 0.006 * torque, seed=seed)
    return report(run, how)


def study(seeds: int, advance: Callable[[int], object]) -> dict[str, dict[str, dict[str, float]]]:
    """Figures of each circuit and law over so many machines each."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for circuit in CIRCUITS:
        found[circuit] = {}
        for law in LAWS:
            days = [day(circuit, law, seed) for seed in range(seeds)]
            advance(seeds)
            found[circuit][law] = figures(days)
    return found


def figures(days: list[Judged]) -> dict[str, float]:
    """The figures of some days together."""
    told = [d for d in days if math.isfinite(d.p95)]
    return {
        "days": len(days),
        "judged": len(told),
        "p95_median_mm": 1e3 * float(np.median([d.p95 for d in told])) if told else math.nan,
        "p95_worst_mm": 1e3 * max((d.p95 for d in told), default=math.nan),
        "ok_worst_mm": 1e3 * max((d.ok_largest for d in told), default=math.nan),
        "band_holds": float(np.mean([d.coverage for d in days])),
        "wrong_and_ok": float(np.mean([d.wrong_and_ok for d in days])),
        "ok": float(np.mean([d.ok for d in days])),
    }
