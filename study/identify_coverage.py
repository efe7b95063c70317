"""How often identify's 95 % intervals hold what they should: machines drawn at random, worked at random.

Each machine differs from its data sheet in all five factors; its loads are unknown and change at rest, its oil warms,
its speeds are no whole rpm, its drive and its position sensor are noisy. The seed decides everything.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ramsight import machine
from ramsight.calibration.identify import FACTORS, identify
from ramsight.duty import DriveReport, Duty, report, simulate
from ramsight.duty.profile import Profile
from ramsight.machine.description import DirectDriven
from ramsight.plant.ddh import DdhUnit, build

RPM = np.pi / 30
RANGES = {
    "leak": (0.8, 1.4),
    "orifice": (0.0, 0.5),
    "displacement": (0.99, 1.01),
    "friction": (0.7, 1.4),
    "stiffness": (0.7, 1.0),
}
_FIRST_SEED = 1000  # the floors of the intervals were set with seeds 0 to 39 in view; these are others
SENSOR_NOISE = 20e-6  # m, standard deviation of the temporary position sensor


def deviating(unit: DirectDriven, factors: dict[str, float]) -> DirectDriven:
    """The unit's description with factors on its data sheet."""
    changes: dict[str, float] = {}
    for name in ("pump_a", "pump_b"):
        pump = getattr(unit, name)
        lost = 1.0 - pump.volumetric_efficiency
        changes[f"{name}.displacement"] = factors["displacement"] * pump.displacement
        changes[f"{name}.volumetric_efficiency"] = 1.0 - factors["leak"] / factors["displacement"] * lost
        changes[f"{name}.orifice_leakage"] = factors["orifice"] * pump.displacement * pump.nominal_speed * lost
    for name in ("breakaway_friction", "coulomb_friction", "viscous_friction"):
        changes[f"cylinder.{name}"] = factors["friction"] * getattr(unit.cylinder, name)
    changes["oil.bulk_modulus"] = factors["stiffness"] * unit.oil.bulk_modulus
    changes["hose.effective_bulk_modulus"] = factors["stiffness"] * unit.hose.effective_bulk_modulus
    return unit.replace(changes)


def commissioning(unit: DdhUnit, largest: float, random: np.random.Generator, moves: int = 14) -> Duty:
    """Lifts and lowers of random speed under loads that change at every second rest; oil 4 K warmer at the end."""
    time, speed, load_time, load = [0.0, 1.0], [0.0, 0.0], [0.0], [largest * random.uniform(0.25, 0.9)]
    stroke = unit.cylinder.stroke
    travel = 0.15 * stroke
    for k in range(moves):
        rpm = random.uniform(700.0, 2000.0)
        lifting = k % 2 == 0
        wanted = random.uniform(0.7, 0.85) if lifting else random.uniform(0.15, 0.3)
        hold = max(abs(wanted * stroke - travel) / (rpm * RPM * unit.travel_per_radian) - 0.6, 0.5)
        signed = rpm * RPM * unit.lift_sign * (1.0 if lifting else -1.0)
        travel = wanted * stroke
        for span, value in ((0.6, signed), (hold, signed), (0.6, 0.0), (2.0, 0.0)):
            time.append(time[-1] + span)
            speed.append(value)
        if k % 2 == 1:
            load_time += [time[-1] - 1.4, time[-1] - 1.0]
            load += [load[-1], largest * random.uniform(0.25, 0.9)]
    kelvin = 273.15 + random.uniform(20.0, 50.0)
    start = 0.15 * stroke if unit.lift_sign > 0.0 else 0.85 * stroke
    return Duty(Profile(time, speed), Profile(load_time, load), Profile([0.0, time[-1]], [kelvin, kelvin + 4.0]), start)


def one(seed: int) -> dict[str, dict[str, float | bool]]:
    """Identify one machine; for each factor what is true, what was found, and whether the interval holds it."""
    random = np.random.default_rng(seed)
    name = "boom" if seed % 2 else "bucket"
    described = machine.load("mining-loader").unit(name)
    true = {key: float(random.uniform(*span)) for key, span in RANGES.items()}
    made, sheet = build(name, deviating(described, true)), build(name, described)
    run = simulate(made, commissioning(made, described.load.loads["high"], random))
    log = report(run, DriveReport(seed=seed))
    run["position"].values[:] += SENSOR_NOISE * random.standard_normal(run.sizes["time"])
    found = identify(sheet, log, run[["position"]])
    return {
        key: {
            "true": true[key],
            "value": found.factors[key].value,
            "half": 0.5 * (found.factors[key].high - found.factors[key].low),
            "told": found.factors[key].told,
            "held": found.factors[key].low <= true[key] <= found.factors[key].high,
        }
        for key in FACTORS
    }


def coverage(seeds: int, advance: Callable[[float], object]) -> dict[str, dict[str, float]]:
    """Share of the intervals that hold the truth, their median half width and the median error, per factor."""
    results = []
    for seed in range(_FIRST_SEED, _FIRST_SEED + seeds):
        results.append(one(seed))
        advance(1.0)
    summary = {}
    for key in FACTORS:
        told = [r[key] for r in results if r[key]["told"]]
        summary[key] = {
            "told": len(told),
            "held": sum(bool(r["held"]) for r in told),
            "half_width": float(np.median([r["half"] for r in told])),
            "error": float(np.median([abs(r["value"] - r["true"]) for r in told])),
            "largest_error": float(np.max([abs(r["value"] - r["true"]) for r in told])),
        }
    return summary
