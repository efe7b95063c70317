"""What the paper states in passing and takes for granted, tested one by one with numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ramsight import simulate
from ramsight.plant.hose import Hose
from ramsight.plant.oil import MINERAL_EXPANSION, T40, T100, walther_constants
from ramsight.plant.pump import Pump
from ramsight.plant.steady import torque_at_load
from ramsight.units import FREEZING
from reproduction.bench import TEMPERATURE, Bench
from reproduction.chapter import Chapter, Grid, Statement, Verdict
from reproduction.figure_style import SENSORS
from reproduction.words import both, figure, slashed

PERIODS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)  # s, between two samples of the drive
_LITTLE_MM = 1.0  # of a cycle; less is called no significant effect
_AGED = 0.9  # viscosity of aged oil over that of new; ISO 3448 has ± 10 % of the grade for new oil, [G]
_SEALS = {"new": 0.02 / 60e3, "worn": 0.5 / 60e3}  # m3/s at 100 bar, 46 mm2/s, all cylinders of a unit, [G]
_SEAL_POINT = 46e-6 / 100e5  # m2/s over Pa, where that is
_COLD, _HOT = 293.15, 333.15  # K; 20 and 60 degC
_KINDS = (("leakage", "leakage"), ("friction", "friction of the pumps"))
_CONTENT = 0.1  # share of the oil in lines
_SMALL = 0.2  # share of the table's own error that is called no significant effect


def taken(benches: dict[str, Bench]) -> Chapter:
    """Density, time step, where oil is missing, seals, oil that ages."""
    density = {unit: _density(bench) for unit, bench in benches.items()}
    periods = {unit: _sampled(bench) for unit, bench in benches.items()}
    lost = {unit: _lost(bench) for unit, bench in benches.items()}
    seals = {unit: {name: _seals(bench, leak) for name, leak in _SEALS.items()} for unit, bench in benches.items()}
    aged = {unit: _aged(bench) for unit, bench in benches.items()}
    rigid = {unit: _rigid(bench) for unit, bench in benches.items()}
    energy = {unit: _energy(bench) for unit, bench in benches.items()}
    return Chapter(
        "What the paper takes for granted, tested",
        (
            "Sentences that the paper states without a figure. Each was simulated; what counts is the table's error of "
            "one cycle at high load and 40 °C, unless it says otherwise.",
        ),
        {
            "variable_density_changes_error_mm": density,
            "sample_period_error_mm": periods,
            "way_lost_in_a_cycle_mm": lost,
            "seal_leakage_changes_error_mm": seals,
            "aged_oil_changes_error_mm": aged,
            "losses_of_a_cycle_percent": energy,
            "steps_of_a_cycle_with_rigid_lines": rigid,
        },
        (
            _density_says(density),
            _time_step_says(periods),
            _lost_says(lost, seals),
            _volumetric_says(energy),
            _ageing_says(aged, seals),
            _lines_say(rigid),
        ),
        grids=(_periods_grid(periods),),
    )


def _table_mm(bench: Bench, actual: Any, temperature: float = TEMPERATURE) -> float:
    """Largest error of the data sheet's table on a unit as built [mm]."""
    run = simulate(actual, bench.cycle(bench.loads["high"], of=actual, temperature=temperature))
    return bench.track(run, bench.sensors["table"]).largest_mm


def _density(bench: Bench) -> dict[str, dict[str, float]]:
    """By how much the error changes if the oil's density goes with its temperature, the nominal one with it [mm]."""
    oil = replace(bench.unit.oil, expansion=MINERAL_EXPANSION)

    def at_nominal(part: Any) -> Any:
        # The nominal viscosity is the oil's at 40 degC; so is then the nominal density.
        return replace(part, nominal_density=float(oil.density_at(T40))) if isinstance(part, Pump) else part

    expands = replace(bench.unit.mapped(at_nominal), oil=oil)
    found = {}
    for temperature in (_COLD, TEMPERATURE, _HOT):
        own = _table_mm(bench, bench.unit, temperature)
        key = f"{temperature - FREEZING:.0f}_degC"
        found[key] = {"own_mm": own, "changed_mm": _table_mm(bench, expands, temperature) - own}
    return found


def _sampled(bench: Bench) -> dict[str, dict[str, float]]:
    """Largest error of each sensor [mm] by the period of the drive's samples."""
    duty, found = bench.cycle(bench.loads["high"]), {}
    for period in PERIODS:
        run = simulate(bench.unit, duty, sample_period=period)
        found[f"{1e3 * period:g}_ms"] = {n: bench.track(run, sensor).largest_mm for n, sensor in bench.sensors.items()}
    return found


def _lost(bench: Bench) -> dict[str, float]:
    """Way that the leakage of a cycle and the compression by the high load amount to [mm]."""
    load = bench.loads["high"]
    point = torque_at_load(bench.unit, load, TEMPERATURE)
    duty = bench.cycle(load)
    speed = np.abs(duty.motor_speed(np.linspace(0.0, duty.duration, 4001)))
    turned = float(speed.mean() * duty.duration)
    leaked = 0.5 * (point.travel_lower - point.travel_lift) * turned
    unit, area = bench.unit, float(bench.unit.cylinder.area(bench.unit.held))
    side = unit.held_side
    content = side.hose.volume + unit.cylinder.dead_volume(unit.held) + 0.5 * area * unit.cylinder.stroke
    soft = content / unit.oil.bulk_modulus + side.hose.volume * (1 / side.hose.bulk_modulus - 1 / unit.oil.bulk_modulus)
    return {"by_pump_leakage": 1e3 * leaked, "by_compression_of_the_load": 1e3 * soft * load / area**2}


def _seals(bench: Bench, leak: float) -> float:
    """By how much leakage past the piston's seals changes the error [mm]."""
    actual = replace(bench.unit, cylinder=replace(bench.unit.cylinder, seal_leak=leak * _SEAL_POINT))
    return _table_mm(bench, actual) - _table_mm(bench, bench.unit)


def _aged(bench: Bench) -> float:
    """By how much oil of nine tenths of its viscosity changes the error [mm]."""
    oil = bench.unit.oil
    a, b = walther_constants(*(v for t in (T40, T100) for v in (t, _AGED * float(oil.viscosity(t)))))
    thin = replace(bench.unit, oil=replace(oil, walther_a=a, walther_b=b))
    return _table_mm(bench, thin) - _table_mm(bench, bench.unit)


def _energy(bench: Bench) -> dict[str, dict[str, float]]:
    """Losses of a cycle over what the motor gives [%], by load at 40 degC and by temperature at high load."""
    points = {name: (load, TEMPERATURE) for name, load in bench.loads.items()}
    points |= {f"high_{t - FREEZING:.0f}_degC": (bench.loads["high"], t) for t in (_COLD, _HOT)}
    found = {}
    for name, (load, temperature) in points.items():
        attrs = simulate(bench.unit, bench.cycle(load, temperature=temperature)).attrs
        pumps = [part.name for part in bench.unit.parts() if isinstance(part, Pump)]
        given = attrs["energy.shaft_given"]
        found[name] = {
            kind: 100.0 * sum(attrs[f"energy.{pump}.{kind}"] for pump in pumps) / given
            for kind in ("leakage", "friction")
        }
    return found


def _rigid(bench: Bench) -> dict[str, int]:
    """Steps of the integrator for a cycle, with the lines as described and with rigid ones that hold little oil."""

    def stiffer(part: Any) -> Any:
        if not isinstance(part, Hose):
            return part
        return replace(part, bulk_modulus=bench.unit.oil.bulk_modulus, volume=_CONTENT * part.volume)

    cases = {"as_described": bench.unit, "rigid": bench.unit.mapped(stiffer)}
    load = bench.loads["high"]
    return {n: int(simulate(u, bench.cycle(load, of=u)).attrs["accepted_steps"]) for n, u in cases.items()}


def _density_says(density: dict[str, dict[str, dict[str, float]]]) -> Statement:
    changed = {unit: max(abs(one["changed_mm"]) for one in by.values()) for unit, by in density.items()}
    share = max(abs(one["changed_mm"]) / one["own_mm"] for by in density.values() for one in by.values())
    return Statement(
        "Section 2",
        "Constant density should not have a significant effect, because the ratio of densities stays near one.",
        f"Mineral oil loses {100.0 * MINERAL_EXPANSION * (_HOT - T40):.1f} % of its density from 40 to 60 °C, and "
        f"eq. 10 puts just that on the leakage. At 20, 40 and 60 °C it changes the table's error of a cycle by up to "
        f"{both(changed)}, at most {100 * share:.0f} % of that error.",
        Verdict.of(share < _SMALL),
    )


def _time_step_says(periods: dict[str, dict[str, dict[str, float]]]) -> Statement:
    def at(key: str) -> dict[str, float]:
        return {unit: by[key]["table"] for unit, by in periods.items()}

    fine, usual, coarse = at("5_ms"), at("20_ms"), at("500_ms")
    near = max(abs(usual[unit] - fine[unit]) for unit in periods)
    far = max(abs(coarse[unit] - fine[unit]) for unit in periods)
    return Statement(
        "Section 2",
        "The largest time step has to be short enough for torque and speed not to vary significantly within it.",
        f"With samples every 5, 20 and 500 ms the table errs by {both(fine)}, {both(usual)} and {both(coarse)}: 20 ms "
        f"differ from 5 ms by {near:.2f} mm, 500 ms by {far:.1f} mm.",
        Verdict.of(far > 3.0 * near and near < _LITTLE_MM),
    )


def _lost_says(lost: dict[str, dict[str, float]], seals: dict[str, dict[str, float]]) -> Statement:
    leaked = {unit: by["by_pump_leakage"] for unit, by in lost.items()}
    pressed = {unit: by["by_compression_of_the_load"] for unit, by in lost.items()}
    new = {unit: abs(by["new"]) for unit, by in seals.items()}
    dominates = all(leaked[u] > pressed[u] > new[u] for u in lost)
    return Statement(
        "Introduction, section 2",
        "Errors are mainly caused by leakage through the pumps, somewhat by compressibility and by small leakage past "
        "the piston's seals.",
        f"In a cycle the pumps' leakage is worth {both(leaked, 0)} of travel, the compression by the load once "
        f"{both(pressed)}, seals of 0.02 l/min at 100 bar {both(new, 2)}.",
        Verdict.of(dominates),
    )


def _volumetric_says(energy: dict[str, dict[str, dict[str, float]]]) -> Statement:
    over_oil = ("high_20_degC", "high", "high_60_degC")
    shares = {
        unit: " and ".join(slashed((by[key][kind] for key in over_oil), 0) + f" % {name}" for kind, name in _KINDS)
        for unit, by in energy.items()
    }
    spread = {
        kind: min(float(np.ptp([by[key][kind] for key in over_oil])) for by in energy.values()) for kind, _ in _KINDS
    }
    light = {unit: by["light"]["leakage"] - by["light"]["friction"] for unit, by in energy.items()}
    return Statement(
        "Section 2",
        "The volumetric efficiency has a more significant effect on the total efficiency than the hydromechanical one.",
        "Of what the motor gives in a cycle at high load and 20 / 40 / 60 °C, "
        + "; ".join(f"{unit} {text}" for unit, text in shares.items())
        + ". What changes the total efficiency is the volumetric one. As an amount the two are alike at 40 °C, and at "
        f"light load the pumps' friction takes more ({', '.join(f'{-v:.0f} points, {u}' for u, v in light.items())}).",
        Verdict.of(spread["leakage"] > 3.0 * spread["friction"]),
    )


def _ageing_says(aged: dict[str, float], seals: dict[str, dict[str, float]]) -> Statement:
    worn = {unit: abs(by["worn"]) for unit, by in seals.items()}
    thin = {unit: abs(change) for unit, change in aged.items()}
    return Statement(
        "Discussion",
        "Wear of seals and ageing of the oil cause further errors (future work in the paper).",
        f"Oil of nine tenths of its viscosity changes the table's error by {both(thin)}, piston seals of 0.5 l/min at "
        f"100 bar by {both(worn)} a cycle. Either shows as leakage, and is learned as such by a sensor that calibrates "
        "itself.",
        Verdict.of(min(abs(value) for value in aged.values()) > _LITTLE_MM),
    )


def _lines_say(rigid: dict[str, dict[str, int]]) -> Statement:
    plain, stiff = ({unit: by[key] for unit, by in rigid.items()} for key in ("as_described", "rigid"))
    return Statement(
        "Section 2",
        "The pipelines' give is important for the stability of the model, which would otherwise be too stiff.",
        "With lines whose walls do not give, a tenth of the oil in them, a cycle takes "
        f"{both(stiff, 0, 'steps')} instead of {both(plain, 0, 'steps')}, and is as stable. For an implicit method it "
        "does not matter. Lines that give are taken as real all the same.",
        Verdict.CONTRADICTED if all(stiff[u] < 3 * plain[u] for u in rigid) else Verdict.REPRODUCED,
    )


def _periods_grid(periods: dict[str, dict[str, dict[str, float]]]) -> Grid:
    rows = tuple(
        (f"{unit}, {period.replace('_', ' ')}", *(figure(errors[name], 2) for name in SENSORS))
        for unit, by in periods.items()
        for period, errors in by.items()
    )
    head = ("unit, samples every", *(look.name for look in SENSORS.values()))
    return Grid("Largest error of one cycle at high load by the period of the drive's samples [mm]", head, rows)
