"""Days that no constant was chosen on: kinds of work and of machines, each drawn at random, with an unknown start.

Bumps, a joystick that never rests, jerks, a load that changes its sign, a pump that begins to leak, cushions, a relief
valve that opens early, pumps that differ. Otherwise machines are drawn as in `work_days`. The seed decides everything.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray
from judged_errors import Judged, judge
from real_machine import LITRE_A_MINUTE, cushions
from work_days import LOADS, drawn_machine, reported

from ramsight import machine
from ramsight.duty import simulate
from ramsight.duty.profile import Duty, Profile
from ramsight.duty.work_day import work_day
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kalman import kalman

DAYS = 25
"""Of each kind; boom and bucket take turns."""
DURATION = 600.0  # s
BAND, WRONG = 0.93, 2e-3  # of a day that is as honest as stated
Random = np.random.Generator
Change = Callable[[Duty, Random], Duty]


def _as_it_is(duty: Duty, random: Random) -> Duty:
    return duty


def _bumps(duty: Duty, random: Random) -> Duty:
    """A load that shakes at 1 to 4 Hz while the motor turns, by 5 to 15 % of its mean."""
    time = np.arange(0.0, duty.duration, 0.02)
    share, rate = random.uniform(0.05, 0.15), random.uniform(1.0, 4.0)
    phase = np.cumsum(2.0 * np.pi * rate * 0.02 * (1.0 + 0.3 * random.standard_normal(time.size)))
    shakes = share * np.sin(phase) * (np.abs(duty.motor_speed(time)) > 0.0)
    return replace(duty, load=Profile(time, duty.load(time) + float(np.mean(duty.load(time))) * shakes))


def _joystick(duty: Duty, random: Random) -> Duty:
    """Speeds that change every quarter of a second, and turn back now and then."""
    time = np.union1d(duty.motor_speed.time, np.arange(0.0, duty.duration, 0.25))
    shares = np.where(random.random(time.size) < 0.1, -0.3, random.uniform(0.3, 1.8, time.size))
    return replace(duty, motor_speed=Profile(time, shares * duty.motor_speed(time)))


def _jerks(duty: Duty, random: Random) -> Duty:
    """Speeds that are reached within 60 to 150 ms."""
    time, value = duty.motor_speed.time.copy(), duty.motor_speed.value
    changes = np.flatnonzero(np.diff(value) != 0.0)
    time[changes + 1] = np.minimum(time[changes + 1], time[changes] + random.uniform(0.06, 0.15))
    return replace(duty, motor_speed=Profile(time, value))


def _over_centre(duty: Duty, random: Random) -> Duty:
    """A load that changes its sign every few seconds, also while the rod moves."""
    time = np.arange(0.0, duty.duration, 0.1)
    mean = float(np.mean(duty.load(time)))
    swings = np.sin(2.0 * np.pi * time / random.uniform(6.0, 15.0))
    return replace(duty, load=Profile(time, 0.4 * duty.load(time) + random.uniform(0.5, 0.8) * mean * swings))


@dataclass(frozen=True)
class Kind:
    """A kind of day."""

    title: str  # for the table
    work: Change = _as_it_is  # what it makes of a day's work
    # draws what the machine has beside the description that it is passed, by the keys of that
    machine: Callable[[Any, Random], Mapping[str, Any]] = field(default=lambda described, random: {})
    built: Callable[[Random], dict[str, float]] = field(default=lambda random: {})  # draws factors of `AsBuilt`
    bursts: bool = False  # whether the pumps leak 1.5 to 3 times as much from some moment on


def _differ(described: Any, random: Random) -> Mapping[str, Any]:
    """Displacements of both pumps, each within ± 2 %."""
    return {
        f"{pump}.displacement": random.uniform(0.98, 1.02) * float(getattr(described, pump).displacement)
        for pump in ("pump_a", "pump_b")
    }


KINDS = {
    "bumps": Kind("a load that shakes by 5 to 15 % at 1 to 4 Hz", _bumps),
    "joystick": Kind("speeds that change every 0.25 s", _joystick),
    "jerks": Kind("speeds that are reached in 60 to 150 ms", _jerks),
    "over_centre": Kind("a load that changes its sign", _over_centre),
    "burst": Kind("pumps that leak 1.5 to 3 times as much from some moment on", bursts=True),
    "cushion": Kind(
        "cushions of 30 mm",
        machine=lambda described, random: cushions(0.03, random.uniform(25.0, 60.0) * LITRE_A_MINUTE),
    ),
    "early_relief": Kind(
        "relief valves that open up to 7 % early", built=lambda random: {"relief": random.uniform(0.93, 1.0)}
    ),
    "pumps_differ": Kind("pumps that differ by up to 4 %", machine=_differ),
}
"""By the key in results/study.json."""


def _later(profile: Profile, at: float) -> Profile:
    """What follows a moment [s], from there on."""
    after = profile.time > at
    return Profile([0.0, *(profile.time[after] - at)], [float(profile(at)), *profile.value[after]])


def _burst(built: AsBuilt, unit: HydraulicUnit, duty: Duty, random: Random) -> xarray.Dataset:
    """A day on which the leakage grows while the motor stands, between a third and two thirds of it."""
    begins, ends, speed = duty.motor_speed.time[:-1], duty.motor_speed.time[1:], duty.motor_speed.value
    rests = (speed[:-1] == 0.0) & (speed[1:] == 0.0) & (begins > random.uniform(0.33, 0.66) * duty.duration)
    at = float(0.5 * (begins + ends)[np.flatnonzero(rests)[0]])
    before = simulate(built.apply(unit), replace(duty, end=at))
    rest = Duty(
        _later(duty.motor_speed, at),
        _later(duty.load, at),
        duty.oil_temperature,
        float(before["position"][-1]),
        end=duty.duration - at,
    )
    after = simulate(replace(built, leak=random.uniform(1.5, 3.0) * built.leak).apply(unit), rest).isel(
        time=slice(1, None)
    )
    after = after.assign_coords(time=("time", after["time"].values + float(before["time"][-1]), before["time"].attrs))
    return xarray.concat([before, after], "time", data_vars="minimal", combine_attrs="override")


def day(kind: Kind, unit: str, seed: int) -> Judged:
    """A day of one machine, judged from its first position on."""
    random = np.random.default_rng([seed, list(KINDS.values()).index(kind)])
    loader = machine.load_machine("mining-loader").unit(unit)
    sheet, real = build(loader, unit), build(loader.replace(dict(kind.machine(loader, random))), unit)
    built = replace(drawn_machine(random), **kind.built(random))
    duty = kind.work(work_day(real, LOADS[unit], random.uniform(298.15, 328.15), duration=DURATION, seed=seed), random)
    run = _burst(built, real, duty, random) if kind.bursts else simulate(built.apply(real), duty)
    log = reported(run, sheet, seed, random)
    sensor = kalman(sheet)
    sensor.start(None)
    track = sensor.track(log)
    return judge(track, log["motor_speed"].values, run["position"].values, float(sheet.cylinder.stroke), after=0)


def runs() -> int:
    """How many days there are."""
    return DAYS * len(KINDS)


def study(advance: Callable[[int], object]) -> dict[str, dict[str, float]]:
    """Figures by kind."""
    found = {}
    for name, kind in KINDS.items():
        days = []
        for seed in range(DAYS):
            days.append(day(kind, ("boom", "bucket")[seed % 2], seed))
            advance(1)
        found[name] = {
            "days": len(days),
            "p95": float(np.nanmedian([one.p95 for one in days])),
            "p95_worst": float(np.nanmax([one.p95 for one in days])),
            "band_least": float(np.nanmin([one.coverage for one in days])),
            "narrow": sum(one.coverage < BAND for one in days),
            "wrong_most": float(np.max([one.wrong_and_ok for one in days])),
            "wrong": sum(one.wrong_and_ok > WRONG for one in days),
            "beyond_most": float(np.nanmax([one.beyond_bound for one in days])),
            "ok": float(np.median([one.ok for one in days])),
        }
    return found


def table(found: dict[str, Any]) -> list[str]:
    """A kind a row."""
    rows = [
        f"| kind | days | 95 % error, median, worst day [mm] | band, least | days below {100 * BAND:.0f} % "
        f"| wrong and ok, most | days above {100 * WRONG:.1f} % | beyond the bound, most | ok, median |",
        "|---" * 9 + "|",
    ]
    return rows + [
        f"| {KINDS[name].title} | {row['days']} | {1e3 * row['p95']:.1f}, {1e3 * row['p95_worst']:.1f} "
        f"| {100 * row['band_least']:.0f} % | {row['narrow']} | {100 * row['wrong_most']:.1f} % | {row['wrong']} "
        f"| {100 * row['beyond_most']:.2f} % | {100 * row['ok']:.0f} % |"
        for name, row in found.items()
    ]
