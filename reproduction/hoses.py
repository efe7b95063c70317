"""Hoses: what their resistance takes, over the sizes that a loader of this flow may have."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from ramsight import simulate
from ramsight.duty.lift_lower import SPEED
from ramsight.plant.ddh import DdhUnit
from ramsight.plant.hose import Hose
from ramsight.plant.pump import Pump
from reproduction.bench import TEMPERATURE, Bench
from reproduction.chapter import Chapter, Grid, Statement, Verdict
from reproduction.words import both, figure

Found = dict[str, dict[str, dict[str, float]]]
"""By unit, size and column."""
DASHES = (8, 10, 12, 16, 20)
"""Sizes of hoses: inner diameter in sixteenths of an inch (SAE J517)."""
_INCH = 25.4e-3  # m
_LENGTH = 3.0  # m, [G] as in the machine's description: from the units on the frame to a boom's cylinders
_FASTEST = 5.0  # m/s, usual in pressure lines; manufacturers' charts end at 5 to 6 m/s
_SIGNIFICANT = 2.0  # % of the energy that the motor gives
_COLD = 293.15  # K; 20 degC


def sized(unit: DdhUnit, dash: int, *, turbulent: bool) -> DdhUnit:
    """A unit with hoses of another size on both sides.

    Args:
        unit: the unit.
        dash: inner diameter in sixteenths of an inch.
        turbulent: whether the flow turns turbulent; else it is laminar at any speed.

    Example:
        >>> from reproduction.bench import benches
        >>> f"{1e3 * sized(benches()['boom'].unit, 12, turbulent=True).a.hose.diameter:.2f}"  # mm
        '19.05'
    """
    diameter = dash / 16.0 * _INCH
    content = 0.25 * math.pi * diameter**2 * _LENGTH

    def change(part: Any) -> Any:
        if not isinstance(part, Hose):
            return part
        return replace(part, diameter=diameter, length=_LENGTH, volume=content, turbulent=turbulent)

    return unit.mapped(change)


def usual_size(unit: DdhUnit, speed: float) -> int:
    """Smallest of `DASHES` in which the oil stays at 5 m/s or slower at a motor speed [rad/s]; else the largest."""
    flow = speed * max(_geared(unit))
    return next((d for d in DASHES if flow / (0.25 * math.pi * (d / 16.0 * _INCH) ** 2) <= _FASTEST), DASHES[-1])


def _geared(unit: DdhUnit) -> tuple[float, ...]:
    """Displacement of each pump per motor angle [m3/rad]."""
    return tuple(float(part.geared_displacement) for part in unit.parts() if isinstance(part, Pump))


def hoses(benches: dict[str, Bench]) -> Chapter:
    """What hoses of several sizes take of a cycle at high and at light load."""
    found = {unit: {f"{dash}": _of_size(bench, dash) for dash in DASHES} for unit, bench in benches.items()}
    usual = {
        unit: {
            "at_1500_rpm": usual_size(bench.unit, SPEED),
            "at_highest_speed": usual_size(bench.unit, bench.unit.max_speed),
        }
        for unit, bench in benches.items()
    }
    return Chapter(
        "Hoses",
        (
            "The paper gives no dimensions. Sizes of hydraulic hoses go by the inner diameter in sixteenths of an inch "
            f"(SAE J517), and a pressure line is usually chosen for {_FASTEST:g} m/s at most. For the larger of each "
            f"unit's flows that makes size {usual['boom']['at_1500_rpm']} (boom) and {usual['bucket']['at_1500_rpm']} "
            "(bucket) at the 1500 rpm of the paper's cycles (marked *), and "
            f"{usual['boom']['at_highest_speed']} and {usual['bucket']['at_highest_speed']} at the motor's highest "
            f"speed (**). Each side's hose is taken as {_LENGTH:g} m of one straight line, laminar or turbulent as its "
            "Reynolds number says. Fittings, bends and swivels add to it and are not known.",
        ),
        {"hoses": found, "usual_hose_dash": usual},
        (_statement(found, usual),),
        grids=(_grid(found, usual),),
    )


def _grid(found: Found, usual: dict[str, dict[str, int]]) -> Grid:
    def marks(unit: str, dash: int) -> str:
        working, fastest = usual[unit]["at_1500_rpm"], usual[unit]["at_highest_speed"]
        return " *" if dash == working else " **" if dash == fastest else ""

    rows = tuple(
        (
            f"{unit}, size {dash} ({dash / 16 * 25.4:.1f} mm){marks(unit, dash)}",
            *(figure(by[key], 2) for key in _COLUMNS),
        )
        for unit, sizes in found.items()
        for dash, by in ((int(name), by) for name, by in sizes.items())
    )
    caption = f"Pressure drop of one hose of {_LENGTH:g} m [bar]; what both take of the motor's energy in a cycle [%]"
    return Grid(caption, ("unit, hose", *_COLUMNS.values()), rows)


_COLUMNS = {
    "drop_bar": "drop at 1500 rpm",
    "drop_if_laminar_bar": "if laminar",
    "drop_at_highest_speed_bar": "at highest speed",
    "drop_at_highest_speed_if_laminar_bar": "if laminar",
    "drop_cold_bar": "1500 rpm, 20 °C",
    "energy_high_percent": "high load, 40 °C",
    "energy_light_percent": "light load, 40 °C",
    "energy_light_cold_percent": "light load, 20 °C",
}


def _of_size(bench: Bench, dash: int) -> dict[str, float]:
    """What hoses of a size take of a unit."""
    unit = sized(bench.unit, dash, turbulent=True)
    side, displacement = unit.a, max(_geared(unit))

    def drop(hose: Hose, speed: float, temperature: float) -> float:
        viscosity, density = unit.oil.viscosity(temperature), unit.oil.density_at(temperature)
        return float(hose.pressure_drop(displacement * speed, viscosity, density)) / 1e5

    laminar = replace(side.hose, turbulent=False)
    return {
        "drop_bar": drop(side.hose, SPEED, TEMPERATURE),
        "drop_if_laminar_bar": drop(laminar, SPEED, TEMPERATURE),
        "drop_at_highest_speed_bar": drop(side.hose, unit.max_speed, TEMPERATURE),
        "drop_at_highest_speed_if_laminar_bar": drop(laminar, unit.max_speed, TEMPERATURE),
        "drop_cold_bar": drop(side.hose, SPEED, _COLD),
        "energy_high_percent": _share(bench, unit, "high", TEMPERATURE),
        "energy_light_percent": _share(bench, unit, "light", TEMPERATURE),
        "energy_light_cold_percent": _share(bench, unit, "light", _COLD),
    }


def _share(bench: Bench, unit: DdhUnit, load: str, temperature: float) -> float:
    """Energy that the hoses take of a cycle, over what the motor gives [%]."""
    run = simulate(unit, bench.cycle(bench.loads[load], of=unit, temperature=temperature))
    taken = sum(run.attrs[f"energy.hose_{side}.throttling"] for side in "ab")
    return float(100.0 * taken / run.attrs["energy.shaft_given"])


def _statement(found: Found, usual: dict[str, dict[str, int]]) -> Statement:
    def taken(size: str, key: str) -> dict[str, float]:
        return {unit: sizes[f"{usual[unit][size]}"][key] for unit, sizes in found.items()}

    tight, wide = taken("at_1500_rpm", "energy_light_percent"), taken("at_highest_speed", "energy_light_percent")
    cold = taken("at_1500_rpm", "energy_light_cold_percent")
    return Statement(
        "Introduction",
        "Hose sizing was found to be a somewhat significant pressure loss source.",
        f"Straight hoses sized for the flow at 1500 rpm take {both(tight, 1, '%')} of the motor's energy at light load "
        f"and 40 °C, {both(cold, 1, '%')} at 20 °C, less at high load. Sized for the highest speed they take "
        f"{both(wide, 1, '%')}. Taken for significant: {_SIGNIFICANT:g} %. The paper's dimensions are not given.",
        Verdict.of(max(tight.values()) >= _SIGNIFICANT),
    )
