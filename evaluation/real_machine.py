"""The boom with what a real machine adds: each effect alone and all together, judged by the data sheet's sensor.

The plant has an effect, the sensor's description has not. A day is a person's kind of work with an end stop every two
minutes; the long days go from a cold start to warm oil over four hours. The seed decides everything.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import xarray

from ramsight import machine
from ramsight.duty import DriveReport, Profile, report, simulate
from ramsight.duty.link_report import LinkReport
from ramsight.duty.work_day import work_day
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kalman import kalman
from ramsight.study.judging import Judged, judge

UNIT = "boom"
LOADS = (100e3, 370e3)  # N
DAYS = 6
DAY, LONG_DAY = 1200.0, 4.0 * 3600.0  # s
VISITS, RARE_VISITS = 120.0, 1800.0  # s from one end stop to the next
COLD, WARM, WARMING = 288.15, 323.15, 2400.0  # K, K and s: a day's oil, and its time constant
LINK = math.radians(0.2)  # of an inclinometer, all its errors together
Draw = Callable[[np.random.Generator], dict[str, Any]]
Spoil = Callable[[xarray.Dataset, np.random.Generator], None]


@dataclass(frozen=True)
class Effect:
    """What a machine has and its data sheet has not.

    Args:
        title: for the table.
        described: other values of the unit's description, drawn.
        reported: what it does to the drive's report.
        oil: from cold to warm, over how long [s].
    """

    title: str
    described: Draw = lambda random: {}
    reported: Spoil = lambda log, random: None
    oil: float | None = None


def _magnets(log: xarray.Dataset, random: np.random.Generator) -> None:
    """Magnets warm by some 60 K in an hour and lose 0.11 % a kelvin: the torque is less than the current says."""
    loss = random.uniform(0.05, 0.08) * (1.0 - np.exp(-log["time"].values / 1800.0))
    log["motor_torque"].values[:] *= 1.0 / (1.0 - loss)


def _late_thermometer(log: xarray.Dataset, random: np.random.Generator) -> None:
    time, oil = log["time"].values, log["oil_temperature"].values.copy()
    log["oil_temperature"].values[:] = np.interp(time - random.uniform(30.0, 90.0), time, oil)


def _cold_thermometer(log: xarray.Dataset, random: np.random.Generator) -> None:
    log["oil_temperature"].values[:] -= 5.0


def _belt(log: xarray.Dataset, random: np.random.Generator) -> None:
    """2.5 % of the torque is lost between motor and pump, whichever way the power goes."""
    torque, speed = log["motor_torque"].values, log["motor_speed"].values
    log["motor_torque"].values[:] = torque * (1.0 + random.uniform(0.02, 0.03) * np.sign(torque * speed))


EFFECTS: dict[str, Effect] = {
    "none": Effect("none: the data sheet"),
    "gap_oil": Effect("oil in the pump 5 K warmer than reported", reported=_cold_thermometer),
    "warming": Effect("oil warms by 35 K, thermometer 30 to 90 s late", reported=_late_thermometer, oil=600.0),
    "magnets": Effect("magnets warm up: 5 to 8 % of the torque", reported=_magnets),
    "displacement": Effect(
        "displacement ± 1.5 %", lambda random: {"displacement": 1.0 + 0.015 * float(random.choice([-1.0, 1.0]))}
    ),
    "belt": Effect("belt: 2 to 3 % of the torque", reported=_belt),
}
"""By the key in study.json."""


def _unit(changes: Mapping[str, Any]) -> HydraulicUnit:
    loader = machine.load("mining-loader")
    as_built = {key: changes[key] for key in changes if "." not in key}
    described = {f"units.{UNIT}.{key}": value for key, value in changes.items() if "." in key}
    made = loader.replace(described) if described else loader
    return AsBuilt(**as_built).apply(build(UNIT, made.unit(UNIT), made.linkage))


def day(keys: tuple[str, ...], seed: int, *, duration: float, visits: float, link: bool = False) -> Judged:
    """One machine's day with these effects, judged from its start on."""
    random = np.random.default_rng([seed, *(list(EFFECTS).index(key) for key in keys)])
    effects = [EFFECTS[key] for key in keys]
    changes: dict[str, Any] = {}
    for effect in effects:
        changes |= effect.described(random)
    if len(effects) > 1:
        changes |= {"leak": random.normal(1.0, 0.15), "displacement": random.normal(1.0, 0.0075)}
        changes |= {"stiffness": random.uniform(0.7, 1.3), "friction": random.uniform(0.6, 1.4)}
    sheet, real = _unit({}), _unit(changes)
    duty = work_day(real, LOADS, 313.15, duration=duration, visit_every=visits, seed=seed)
    oil = max((effect.oil or 0.0 for effect in effects), default=0.0)
    if oil or len(effects) > 1:
        after = np.linspace(0.0, duty.duration, 60)
        constant = WARMING if len(effects) > 1 else oil
        duty = replace(duty, oil_temperature=Profile(after, WARM + (COLD - WARM) * np.exp(-after / constant)))
    run = simulate(real, duty)
    errors = random.normal(0.0, 0.5 * LINK), 0.5 * LINK
    angle = (
        LinkReport(sheet.lever, offset=float(errors[0]), noise=errors[1], seed=seed) if link and sheet.lever else None
    )
    log = report(run, DriveReport(seed=seed, link=angle))
    for effect in effects:
        effect.reported(log, random)
    declared = {"link_angle.std": 0.5 * LINK, "link_angle.offset": 0.5 * LINK} if link else {}
    sensor = kalman(sheet, sheet.assumptions.replace(declared))
    sensor.start(duty.start_position)
    track = sensor.track(log)
    return judge(
        track, log["motor_speed"].values, run["position"].values, sheet.cylinder.stroke, after=0 if link else 3
    )


def figures(days: list[Judged]) -> dict[str, float]:
    """Of some machines' days."""
    return {
        "days": len(days),
        "p95_mm": 1e3 * float(np.nanmedian([one.p95 for one in days])),
        "p95_worst_mm": 1e3 * float(np.nanmax([one.p95 for one in days])),
        "largest_mm": 1e3 * float(np.nanmax([one.largest for one in days])),
        "ok_p95_worst_mm": 1e3 * float(np.nanmax([one.ok_p95 for one in days])),
        "band": float(np.mean([one.coverage for one in days])),
        "band_least": float(min(one.coverage for one in days)),
        "wrong_and_ok": float(np.mean([one.wrong_and_ok for one in days])),
        "ok": float(np.mean([one.ok for one in days])),
        "std_mm": 1e3 * float(np.nanmedian([one.std for one in days])),
    }


def study(days: int, advance: Callable[[int], object]) -> dict[str, dict[str, float]]:
    """Figures of each effect alone, and of all together."""
    found: dict[str, dict[str, float]] = {}
    for key in EFFECTS:
        done = []
        for seed in range(days):
            done.append(day((key,), seed, duration=DAY, visits=VISITS))
            advance(1)
        found[key] = figures(done)
    every = tuple(key for key in EFFECTS if key != "none")
    for name, visits, link in (("all", VISITS, False), ("all_link", RARE_VISITS, True)):
        done = []
        for seed in range(days):
            done.append(day(every, seed, duration=LONG_DAY, visits=visits, link=link))
            advance(1)
        found[name] = figures(done)
    return found


if __name__ == "__main__":
    import sys

    wanted = sys.argv[1:]
    for key in wanted or EFFECTS:
        print(key, [asdict(day((key,), seed, duration=DAY, visits=VISITS)) for seed in range(2)])
