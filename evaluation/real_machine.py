"""The boom with what a real machine adds: each effect alone and all together, judged by the data sheet's sensor.

Each effect is in the plant with a value drawn at random. Its sensor is made of a description that does not know it, and
of one that has its usual value. A day is random work with an end stop every two minutes; the long days go from a cold
start to warm oil over four hours. The seed decides everything.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray
from effects import both_pumps
from judged_errors import Judged, judge
from numpy.typing import NDArray

from ramsight import machine
from ramsight.duty import DriveReport, Duty, Magnets, Profile, report, simulate
from ramsight.duty.oil_warming import warmed
from ramsight.duty.profile import constant
from ramsight.duty.reading_report import LinkReport
from ramsight.duty.work_day import work_day
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build
from ramsight.plant.heat import HeatStores
from ramsight.plant.oil import kinematic_viscosity
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kalman import kalman

UNIT = "boom"
DAYS = 6
LOADS = (100e3, 370e3)  # N
HEAVY = (100e3, 500e3)  # N; the relief valve's setting is 531 kN
DAY, LONG_DAY = 1200.0, 4.0 * 3600.0  # s
VISITS, RARE_VISITS = 120.0, 1800.0  # s from one end stop to the next
COLD, WARM = 288.15, 323.15  # K, of a day's oil
COLD_START, WARMING = 2400.0, 600.0  # s, time constants of the oil's warming: of a long day, and of a short one
NIGHT, COOLS = 8.0 * 3600.0, 7200.0  # s
LEAK_AT = (20.0, 30.0, 40.0, 48.0)  # degC
COLDER = 5.0  # K, of the thermometer than the oil in the pumps
LINK = math.radians(0.2)  # of an inclinometer, all its errors together
Array = NDArray[np.float64]
Draw = Callable[[np.random.Generator], dict[str, Any]]
Spoil = Callable[[xarray.Dataset, np.random.Generator], None]


@dataclass(frozen=True)
class Day:
    """A day as the sensor saw it, and as it was."""

    track: xarray.Dataset  # the sensor's
    motor_speed: Array  # [rad/s]
    position: Array  # the true one [m]
    stroke: float  # [m]
    oil: Array  # temperature of the oil in the pumps' gaps [K]
    # leakage over what the sensor's description says at the reported temperature [1], the thermometer's lag left out:
    # what its factor of leakage should be
    leak: Array


@dataclass(frozen=True)
class Effect:
    """What a machine has and its data sheet may not have."""

    title: str  # for the table
    # its usual values in a unit's description; none where no description can have it
    usual: Mapping[str, Any] = field(default_factory=dict)
    drawn: Draw = lambda random: {}  # its values in the machine: of the description, and of `AsBuilt`
    reported: Spoil = lambda log, random: None  # what it does to the drive's report
    warms: bool = False  # whether the oil warms
    loads: tuple[float, float] = LOADS  # least and greatest [N]
    peaks: bool = False  # whether a load comes and goes at rest
    heats: bool = False  # whether the oil is warmed up by what is lost in it


def _magnets(log: xarray.Dataset, random: np.random.Generator) -> None:
    """Magnets that warm up by 45 to 75 K under the torques of this work: 5 to 8 % of the torque."""
    torque = log["motor_torque"].values
    usual = float(np.sqrt(np.mean(torque**2)))
    torque *= Magnets(torque=usual, rise=random.uniform(45.0, 75.0)).gain(log["time"].values, torque)


def _late_thermometer(log: xarray.Dataset, random: np.random.Generator) -> None:
    time, oil = log["time"].values, log["oil_temperature"].values.copy()
    log["oil_temperature"].values[:] = np.interp(time - random.uniform(30.0, 90.0), time, oil)


def _cold_thermometer(log: xarray.Dataset, random: np.random.Generator) -> None:
    log["oil_temperature"].values[:] -= COLDER


def cushions(length: float, flow: float) -> dict[str, Any]:
    """Of the loader's cylinders at both ends, by their length [m] and what they let pass [m3/s]."""
    lengths = {"cylinder.cushion_length_a": length, "cylinder.cushion_length_b": length}
    return {**lengths, "cylinder.cushion_plunger_a": 0.06, "cylinder.cushion_flow": flow}


COOLER = 60.0
"""Conductance from the tank to the air with an oil cooler of 2 kW at 35 K [W/K]."""


def _heat(case: float = 1.0, to_tank: float = 1.0) -> dict[str, float]:
    """Heat stores of a unit of some kW, with factors on what they hold and on what oil carries away; it has a cooler.

    Work that goes on for hours, as this does, heats a bare tank beyond what oil bears.
    """
    usual = HeatStores()
    return {"case": case * usual.case, "case_to_tank": to_tank * usual.case_to_tank, "tank_to_air": COOLER}


_WARMER = {"assumptions.thermometer.offset": COLDER}
"""That the oil in the pumps is warmer or colder than reported, and nobody knows by how much."""

LITRE_A_MINUTE = 1e-3 / 60.0

EFFECTS: dict[str, Effect] = {
    "none": Effect("none: the data sheet"),
    "gap_oil": Effect("oil in the pumps 5 K warmer than reported", _WARMER, reported=_cold_thermometer),
    "warming": Effect("oil warms by 35 K, thermometer 30 to 90 s late", reported=_late_thermometer, warms=True),
    "relief": Effect(
        "relief valve ± 7 %, pilot leaks 1 l/min, loads up to 94 % of it",
        {"relief_valve.pilot_leakage": LITRE_A_MINUTE},
        lambda random: {"relief": random.uniform(0.93, 1.07), "relief_valve.pilot_leakage": LITRE_A_MINUTE},
        loads=HEAVY,
    ),
    "magnets": Effect("magnets warm up: 5 to 8 % of the torque", reported=_magnets),
    "compression": Effect(
        "pumps compress their oil",
        both_pumps(compression="in efficiency"),
        lambda random: both_pumps(compression="in efficiency"),
    ),
    "closed_valves": Effect(
        "closed valves leak 0.3 to 10 ml/min",
        {"safety_valve.closed_leakage": 1e-3 * LITRE_A_MINUTE},
        lambda random: {"safety_valve.closed_leakage": math.exp(random.uniform(-1.2, 2.3)) * 1e-3 * LITRE_A_MINUTE},
    ),
    "expansion": Effect(
        "oil that is shut in expands; it warms by 35 K",
        {"oil.thermal_expansion": 7e-4},
        lambda random: {"oil.thermal_expansion": random.uniform(6.5e-4, 7.5e-4)},
        warms=True,
    ),
    "cushions": Effect(
        "end cushions",
        cushions(0.03, 40.0 * LITRE_A_MINUTE),
        lambda random: cushions(0.03, random.uniform(25.0, 60.0) * LITRE_A_MINUTE),
    ),
    "displacement": Effect(
        "displacement ± 1.5 %", drawn=lambda random: {"displacement": 1.0 + 0.015 * float(random.choice([-1.0, 1.0]))}
    ),
    "belt": Effect(
        "belts lose 2 to 3 % of the torque, creep 0.5 to 1 %",
        both_pumps(belt_efficiency=0.975, belt_creep=0.0075),
        lambda random: both_pumps(belt_efficiency=random.uniform(0.97, 0.98), belt_creep=random.uniform(0.005, 0.01)),
    ),
    "drag": Effect(
        "pumps drag: 0.005 to 0.01 N m s/rad a block (C_v 0.7 to 1.5e5)",
        both_pumps(viscous_drag=0.007),
        lambda random: both_pumps(viscous_drag=random.uniform(0.005, 0.01)),
    ),
    "air": Effect(
        "free air 0.25 to 1 %, also in what the pumps draw",
        {"oil.free_air": 0.005, **both_pumps(compression="beside efficiency")},
        lambda random: {"oil.free_air": random.uniform(0.0025, 0.01), **both_pumps(compression="beside efficiency")},
    ),
    "peaks": Effect("a load of 40 % more comes and goes at rest", peaks=True),
    "own_heat": Effect(
        "losses heat cases and tank from 15 °C, the thermometer is in the tank; stores and ways known to ± 40 %",
        {"heat": _heat()},
        lambda random: {"heat": _heat(random.uniform(0.7, 1.4), random.uniform(0.7, 1.4))},
        heats=True,
    ),
    "starving": Effect(
        "pumps starve: 0.12 bar at their inlet, and they want 0.9 to 1.1 bar at their highest speed",
        {"tank.pressure": 0.12e5, **both_pumps(min_inlet_pressure=1e5)},
        lambda random: {"tank.pressure": 0.12e5, **both_pumps(min_inlet_pressure=random.uniform(0.9e5, 1.1e5))},
    ),
}
"""By the key in results/study.json."""

TOGETHER = tuple(key for key in EFFECTS if key not in ("none", "relief", "air", "own_heat", "starving"))
"""Oil over the relief valve loses the position; free air and compression are two conventions of one law, and oil that
warms in the pumps is there already; a machine whose pumps starve is stopped."""
HEATED = tuple("own_heat" if key == "gap_oil" else key for key in TOGETHER)
"""The same with oil that is warmed by what the machine loses, in the place of one that is warmer all the time."""


def unit_with(changes: Mapping[str, Any]) -> HydraulicUnit:
    """The loader's boom with values of its description changed, and as built."""
    loader = machine.load_machine("mining-loader")
    unit = loader.unit(UNIT)
    described = {key: value for key, value in changes.items() if "." in key or key in type(unit).model_fields}
    as_built = {key: value for key, value in changes.items() if key not in described}
    unit = unit.replace(described)
    return AsBuilt(**as_built).apply(build(unit, UNIT))


def _peaked(duty: Duty) -> Duty:
    """The duty with a load that comes and goes within each rest of at least two seconds."""
    begins, ends, speed = duty.motor_speed.time[:-1], duty.motor_speed.time[1:], duty.motor_speed.value
    still = (speed[:-1] == 0.0) & (speed[1:] == 0.0) & (ends - begins > 2.0)
    places = [begins[still] + share * (ends - begins)[still] for share in (0.4, 0.5, 0.6, 0.7)]
    times = np.unique(np.concatenate([duty.load.time, *places]))
    values = duty.load(times)
    high = np.isin(times, np.concatenate(places[1:3]))
    return replace(duty, load=Profile(times, np.where(high, 1.4 * values, values)))


def _oil(time_constant: float, end: float) -> Profile:
    after = np.linspace(0.0, end, 60)
    return Profile(after, WARM + (COLD - WARM) * np.exp(-after / time_constant))


def tracked(keys: tuple[str, ...], seed: int, *, duration: float, visits: float, told: bool, link: bool = False) -> Day:
    """One machine's day with these effects.

    Args:
        keys: of the effects; with several the machine is not its data sheet either, and the oil warms.
        seed: of everything.
        duration: [s].
        visits: from one end stop to the next [s].
        told: whether the sensor's description has the effects' usual values.
        link: whether there is an inclinometer on the boom.
    """
    random = np.random.default_rng([seed, *(list(EFFECTS).index(key) for key in keys)])
    effects = [EFFECTS[key] for key in keys]
    changes: dict[str, Any] = {}
    for effect in effects:
        changes |= effect.drawn(random)
    if len(effects) > 1:
        changes |= {"leak": random.normal(1.0, 0.15), "displacement": random.normal(1.0, 0.006)}
        changes |= {"stiffness": random.uniform(0.7, 1.3), "friction": random.uniform(0.6, 1.4)}
    usual = {key: value for effect in effects for key, value in effect.usual.items()} if told else {}
    sheet, real = unit_with(usual), unit_with(changes)
    loads = max(effect.loads for effect in effects)
    duty = work_day(real, loads, 313.15, duration=duration, visit_every=visits, seed=seed)
    if any(effect.warms for effect in effects):
        duty = replace(duty, oil_temperature=_oil(WARMING if len(effects) == 1 else COLD_START, duty.duration))
    if any(effect.peaks for effect in effects):
        duty = _peaked(duty)
    if any(effect.heats for effect in effects):
        run = warmed(real, replace(duty, oil_temperature=constant(COLD)))
        oil = run["pump_temperature"].values
    else:
        run = simulate(real, duty)
        oil = run["oil_temperature"].values
    offset, noise = float(random.normal(0.0, 0.5 * LINK)), 0.5 * LINK
    angle = LinkReport(sheet.lever, offset=offset, noise=noise, seed=seed) if link and sheet.lever else None
    log = report(run, DriveReport(seed=seed, link=angle))
    for effect in effects:
        effect.reported(log, random)
    declared = {"link_angle.std": noise, "link_angle.offset": 0.5 * LINK} if link else {}
    sensor = kalman(sheet, sheet.assumptions.replace(declared))
    sensor.start(duty.start_position)
    track = sensor.track(log)
    reported = oil - (COLDER if "gap_oil" in keys else 0.0)
    law = sheet.oil.walther_a, sheet.oil.walther_b
    thinner = kinematic_viscosity(reported, *law) / kinematic_viscosity(oil, *law)
    leak = changes.get("leak", 1.0) * np.asarray(thinner).ravel()
    return Day(track, log["motor_speed"].values, run["position"].values, float(sheet.cylinder.stroke), oil, leak)


def judged(one: Day, *, link: bool = False) -> Judged:
    """A day judged after three stops, or from its start with an inclinometer."""
    return judge(one.track, one.motor_speed, one.position, one.stroke, after=0 if link else 3)


def leakage(days: list[Day]) -> dict[str, dict[str, float]]:
    """The factor of leakage over what the machine has, by the temperature in the pumps [degC]: least, median, most."""
    found = {}
    for celsius in LEAK_AT:
        over, std = [], []
        for one in days:
            there = np.abs(one.oil - 273.15 - celsius) < 0.5
            over.append(float(np.median(one.track["leak_factor"].values[there] / one.leak[there])))
            std.append(float(np.median(one.track["leak_factor_std"].values[there] / one.leak[there])))
        found[f"{celsius:g}"] = {
            "least": min(over), "median": float(np.median(over)), "most": max(over), "std": float(np.median(std)),
        }  # fmt: skip
    return found


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


def night(seed: int, *, told: bool) -> dict[str, float]:
    """A night at rest: oil cools from warm to cold and valves leak; error and standard deviation in the morning [m]."""
    random = np.random.default_rng([seed, 1])
    effects = (EFFECTS["closed_valves"], EFFECTS["expansion"])
    changes = {key: value for effect in effects for key, value in effect.drawn(random).items()}
    usual = {key: value for effect in effects for key, value in effect.usual.items()} if told else {}
    sheet, real = unit_with(usual), unit_with(changes)
    speed = Profile([0.0, 1.0, 2.0, 6.0, 7.0, 10.0 + NIGHT], [0.0, 0.0, 100.0, 100.0, 0.0, 0.0])
    after = np.linspace(10.0, 10.0 + NIGHT, 60)
    cools = COLD + (WARM - COLD) * np.exp(-(after - 10.0) / COOLS)
    oil = Profile(np.concatenate([[0.0], after]), np.concatenate([[WARM], cools]))
    duty = Duty(speed, constant(random.uniform(*LOADS)), oil, 0.2)
    run = simulate(real, duty, sample_period=0.1)
    sensor = kalman(sheet)
    sensor.start(0.2)
    track = sensor.track(report(run, DriveReport(seed=seed))).isel(time=-1)
    error = float(track["position"]) - float(run["position"][-1])
    return {"error": abs(error), "std": float(track["position_std"]), "status": float(track["status"])}


def runs(days: int) -> int:
    """How many days are run."""
    return days * (1 + sum(1 + bool(effect.usual) for key, effect in EFFECTS.items() if key != "none") + 5)


def study(days: int, advance: Callable[[int], object]) -> dict[str, Any]:
    """Figures of each effect alone, of all together, and of nights."""
    found: dict[str, Any] = {"alone": {}, "together": {}, "leakage": {}, "night": {}}

    def some(keys: tuple[str, ...], link: bool = False, **how: Any) -> tuple[dict[str, float], list[Day]]:
        done = []
        for seed in range(days):
            done.append(tracked(keys, seed, link=link, **how))
            advance(1)
        return figures([judged(one, link=link) for one in done]), done

    for key, effect in EFFECTS.items():
        for told in (False, True) if effect.usual else (False,):
            figured, _ = some((key,), duration=DAY, visits=VISITS, told=told)
            found["alone"].setdefault(key, {})["told" if told else "untold"] = figured
    for kind, keys, visits in (("stops", TOGETHER, VISITS), ("heat", HEATED, VISITS), ("link", TOGETHER, RARE_VISITS)):
        figured, done = some(keys, link=kind == "link", duration=LONG_DAY, visits=visits, told=True)
        found["together"][kind] = figured
        if keys is TOGETHER:
            found["leakage"][kind] = leakage(done)
    for told in (False, True):
        nights = []
        for seed in range(days):
            nights.append(night(seed, told=told))
            advance(1)
        found["night"]["told" if told else "untold"] = {
            "nights": days,
            "largest_mm": 1e3 * max(one["error"] for one in nights),
            "over_std": max(one["error"] / one["std"] for one in nights),
            "ok": float(np.mean([one["status"] == 0.0 for one in nights])),
        }
    return found


def table(found: dict[str, Any]) -> list[str]:
    """The table of docs/reference/real-machines.md."""
    head = ["| effect | sensor's description | 95 % within: median, worst day | largest | band | ok beyond 4 σ | ok |"]
    rows = [*head, "|---|---|---|---|---|---|---|"]
    for key, kinds in found["alone"].items():
        for kind, row in kinds.items():
            said = "has it" if kind == "told" else "–" if key == "none" else "does not know it"
            rows.append(_row(EFFECTS[key].title, said, row))
    together = {
        "stops": "all, a stop every 2 min",
        "heat": "all, but warmed by its own losses, a stop every 2 min",
        "link": "all, inclinometer, a stop every 30 min",
    }
    for key, title in together.items():
        rows.append(_row(f"**{title}**", "usual values", found["together"][key]))
    return rows


def _row(title: str, said: str, row: dict[str, float]) -> str:
    return (
        f"| {title} | {said} | {row['p95_mm']:.1f}, {row['p95_worst_mm']:.1f} mm | {row['largest_mm']:.1f} mm "
        f"| {100 * row['band']:.0f} % | {100 * row['wrong_and_ok']:.2f} % | {100 * row['ok']:.0f} % |"
    )
