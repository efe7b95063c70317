"""What the table takes for granted: the oil's temperature as read, and pumps that leak as when new."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.duty.lift_lower import lift_lower
from ramsight.duty.simulate import simulate
from ramsight.study.paper.bench import TEMPERATURE, Bench
from ramsight.study.paper.drawing import BALANCE, ESTIMATE, TRUTH, UNITS
from ramsight.study.paper.parts import Chapter, Picture, Statement, Verdict

if TYPE_CHECKING:
    import xarray

OFFSETS = (-5.0, -4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0)  # K, reading less truth
LEAK_FACTORS = (0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.5, 1.75, 2.0)
_COLOURS = {"table": ESTIMATE, "balance": BALANCE}

Found = dict[str, dict[str, dict[float, float]]]


def temperature(benches: dict[str, Bench]) -> Chapter:
    """A temperature sensor that reads wrong."""
    found: Found = {}
    for unit, bench in benches.items():
        run = simulate(bench.unit, lift_lower(bench.unit, bench.loads["high"], TEMPERATURE))
        found[unit] = {
            name: {
                offset: bench.track(run, sensor, add=partial(_warmer, by=offset)).lifted_mm(bench.unit.lift_sign)
                for offset in OFFSETS
            }
            for name, sensor in bench.sensors.items()
        }
    slope = {unit: {name: (by[5.0] - by[0.0]) / 5.0 for name, by in sensors.items()} for unit, sensors in found.items()}
    return Chapter(
        "An oil temperature that is read wrong",
        (
            "Viscosity decides the leakage, and the sensors take it from the temperature that they are told. A "
            f"reading 5 K too high costs the balance sensor {abs(found['boom']['balance'][5.0]):.1f} mm (boom) and "
            f"{abs(found['bucket']['balance'][5.0]):.1f} mm (bucket) in one cycle at high load, "
            f"{abs(slope['boom']['balance']):.2f} and {abs(slope['bucket']['balance']):.2f} mm per K. The table "
            "suffers alike, on top of its error in the ramps; a reading that is too warm hides that error, one that "
            "is too cold adds to it.",
        ),
        {
            "temperature_error_mm": {
                unit: {name: {f"{o:+g}_K": e for o, e in by.items()} for name, by in sensors.items()}
                for unit, sensors in found.items()
            },
            "temperature_error_mm_per_K": slope,
        },
        (
            Statement(
                "Abstract",
                "Using only torque and speed data from the motor controller it is possible to simulate the "
                "position, provided that all relevant parameters are known.",
                "Torque and speed suffice only together with the oil's temperature: 1 K read wrong costs "
                f"{abs(slope['boom']['table']):.1f} mm (boom) and {abs(slope['bucket']['table']):.1f} mm (bucket) a "
                "cycle with the table.",
                Verdict.PARTLY,
            ),
        ),
        (
            Picture(
                "fig21_temperature",
                "Error at the end of one cycle at high load, 40 °C, over the error of the temperature reading.",
                lambda figure: _draw(figure, found, "temperature reading less truth [K]"),
                (7.2, 3.4),
            ),
        ),
    )


def wear(benches: dict[str, Bench]) -> Chapter:
    """Pumps that leak more than their data sheet says."""
    found: Found = {}
    for unit, bench in benches.items():
        found[unit] = {name: {} for name in bench.sensors}
        for factor in LEAK_FACTORS:
            worn = bench.worn(factor)
            run = simulate(worn, lift_lower(worn, bench.loads["high"], TEMPERATURE, start_position=bench.at(0.5)))
            for name, sensor in bench.sensors.items():
                found[unit][name][factor] = bench.track(run, sensor).lifted_mm(bench.unit.lift_sign)
    ten = {unit: {name: by[1.1] - by[1.0] for name, by in sensors.items()} for unit, sensors in found.items()}
    return Chapter(
        "Wear",
        (
            "The paper assumes that the pumps do not wear. With 10 % more leakage the error of one cycle grows by "
            f"{abs(ten['boom']['balance']):.1f} mm (boom) and {abs(ten['bucket']['balance']):.1f} mm (bucket) for "
            f"the balance sensor and by {abs(ten['boom']['table']):.1f} and {abs(ten['bucket']['table']):.1f} mm for "
            "the table; with pumps that leak twice as much the balance sensor is off by "
            f"{abs(found['boom']['balance'][2.0]):.0f} and {abs(found['bucket']['balance'][2.0]):.0f} mm. Both have "
            "to be told, or to learn, what the pumps leak.",
        ),
        {
            "wear_error_mm": {
                unit: {name: {f"{f:g}_times": e for f, e in by.items()} for name, by in sensors.items()}
                for unit, sensors in found.items()
            },
            "wear_error_mm_per_10_percent": ten,
        },
        pictures=(
            Picture(
                "fig22_wear",
                "Error at the end of one cycle at high load, 40 °C, over the pumps' leakage; sensors made for new "
                "pumps.",
                lambda figure: _draw(figure, found, "leakage over the data sheet's [1]"),
                (7.2, 3.4),
            ),
        ),
    )


def _warmer(log: xarray.Dataset, by: float) -> xarray.Dataset:
    changed = log.copy()
    changed["oil_temperature"] = log["oil_temperature"] + by
    return changed


def _draw(figure: Any, found: Found, label: str) -> None:
    axes = figure.add_subplot()
    for unit, sensors in found.items():
        style, marker = UNITS[unit]
        for name, by in sensors.items():
            axes.plot(
                list(by), np.array(list(by.values())), style + marker, color=_COLOURS[name], label=f"{name}, {unit}"
            )
    axes.axhline(0.0, color=TRUTH, lw=0.6)
    axes.set(xlabel=label, ylabel="error after the cycle,\ntowards lifting [mm]")
    axes.legend(ncols=2)
