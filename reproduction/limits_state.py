"""What the sensors take for granted: the oil's temperature as read, and pumps that leak as when new."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight import simulate
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit
from reproduction.bench import Bench
from reproduction.chapter import Chapter, Picture, Statement, Verdict
from reproduction.figure_style import SENSORS, TRUTH, Look
from reproduction.taught import START, VISITS, taught_mm
from reproduction.words import both

if TYPE_CHECKING:
    import xarray

OFFSETS = (-5.0, -4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0)  # K, reading less truth
LEAK_FACTORS = (0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.5, 1.75, 2.0)
TAUGHT = "kalman_after_stops"
_LOOKS = {**SENSORS, TAUGHT: Look(f"self-calibrating, after {VISITS} stops", SENSORS["kalman"].colour, "-")}

_WIDTHS = {"table": 1.5, "balance": 3.5, "kalman": 1.2, TAUGHT: 1.5}  # pt; two of them coincide

Found = dict[str, dict[str, dict[float, float]]]


def temperature(benches: dict[str, Bench]) -> Chapter:
    """A temperature sensor that reads wrong."""
    found: Found = {}
    for unit, bench in benches.items():
        run = simulate(bench.unit, bench.cycle(bench.loads["high"]))
        found[unit] = {
            name: {
                offset: bench.track(run, sensor, add=partial(warmer, by=offset)).lifted_mm(bench.unit.lift_sign)
                for offset in OFFSETS
            }
            for name, sensor in bench.sensors.items()
        }
        found[unit][TAUGHT] = {o: taught_mm(bench, bench.unit, add=partial(warmer, by=o)) for o in OFFSETS}
    slope = {unit: {name: (by[5.0] - by[0.0]) / 5.0 for name, by in sensors.items()} for unit, sensors in found.items()}
    return Chapter(
        "An oil temperature that is read wrong",
        (
            "Viscosity decides the leakage, and the sensors take it from the reported temperature. A "
            f"reading 5 K too high costs the balance {both(_at(found, 'balance', 5.0))} in one cycle at high load, "
            f"{both(_of(slope, 'balance'), 2, 'mm per K')}. The table suffers alike, on top of its error in the ramps; "
            "a reading that is too warm hides that error, one that is too cold adds to it. The self-calibrating sensor "
            f"takes a standing error of the thermometer for leakage and learns it. After {VISITS} end stops a reading "
            f"5 K too high costs {both(_at(found, TAUGHT, 5.0))}.",
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
                "Speed and torque suffice, the oil's temperature being one of the parameters: the paper measures it "
                f"and has tables for it. 1 K read wrong costs {both(_of(slope, 'table'))} a cycle with the table.",
                Verdict.of(max(abs(by["balance"][0.0]) for by in found.values()) < 1.0),
            ),
        ),
        (
            Picture(
                "fig21_temperature",
                "Error at the end of one cycle at high load, 40 °C, over the error of the temperature reading; of the "
                "taught sensor the largest error of the cycle.",
                lambda figure: _draw(figure, found, "temperature reading less truth [K]"),
                (7.2, 3.8),
            ),
        ),
    )


def wear(benches: dict[str, Bench]) -> Chapter:
    """Pumps that leak more than their data sheet states."""
    found: Found = {}
    for unit, bench in benches.items():
        found[unit] = {name: {} for name in _LOOKS}
        for factor in LEAK_FACTORS:
            worn = bench.worn(factor)
            run = simulate(worn, bench.cycle(bench.loads["high"], of=worn, start=START))
            for name, sensor in bench.sensors.items():
                found[unit][name][factor] = bench.track(run, sensor).lifted_mm(bench.unit.lift_sign)
            found[unit][TAUGHT][factor] = taught_mm(bench, worn)
    ten = {unit: {name: by[1.1] - by[1.0] for name, by in sensors.items()} for unit, sensors in found.items()}
    return Chapter(
        "Pumps that leak otherwise than their data sheet",
        (
            "Here the advantage of the volume balance ends: it knew the plant's own leakage. With 10 % more of it the "
            f"error of one cycle grows by {both(_of(ten, 'balance'))} for the balance and by {both(_of(ten, 'table'))} "
            "for the table. Both lose alike. With pumps that leak twice as much they are off by "
            f"{both(_at(found, 'balance', 2.0), 0)} and {both(_at(found, 'table', 2.0), 0)}. The self-calibrating "
            f"sensor learns the leakage from the end stops that it meets. After {VISITS} of them, without a start "
            f"position, it is within {both(_at(found, TAUGHT, 1.1), 2)} at 10 % and "
            f"{both(_at(found, TAUGHT, 2.0), 2)} at 100 %.",
        ),
        {
            "wear_error_mm": {
                unit: {name: {f"{f:g}_times": e for f, e in by.items()} for name, by in sensors.items()}
                for unit, sensors in found.items()
            },
            "wear_error_mm_per_10_percent": ten,
        },
        (_wear_matters(found), _efficiencies_matter(benches, ten)),
        (
            Picture(
                "fig22_wear",
                "Error at the end of one cycle at high load, 40 °C, over the pumps' leakage, of sensors made for new "
                "pumps; of the taught sensor the largest error of the cycle.",
                lambda figure: _draw(figure, found, "leakage over the data sheet's [1]"),
                (7.2, 3.8),
            ),
        ),
    )


def warmer(log: xarray.Dataset, by: float) -> xarray.Dataset:
    """A log whose temperatures read higher by some kelvin."""
    changed = log.copy()
    changed["oil_temperature"] = log["oil_temperature"] + by
    return changed


def _wear_matters(found: Found) -> Statement:
    return Statement(
        "Discussion",
        "In a real system seal wear causes further errors, which are difficult to predict unless wear is modelled.",
        f"Pumps that leak twice as much: table {both(_at(found, 'table', 2.0), 0)} a cycle. Wear need not be "
        f"predicted, it can be learned: {both(_at(found, TAUGHT, 2.0), 1)} after {VISITS} end stops.",
        Verdict.of(min(_at(found, "table", 2.0).values()) > 10.0),
    )


def _efficiencies_matter(benches: dict[str, Bench], ten: dict[str, dict[str, float]]) -> Statement:
    leaks = {unit: 100.0 * _share_of(bench.unit) for unit, bench in benches.items()}
    return Statement(
        "Discussion",
        "The inaccuracies that remain are how accurately the manufacturer defines the pumps' efficiencies; this "
        "becomes a significant source of error in a more unknown system.",
        "One point of volumetric efficiency (of both pumps) is "
        f"{both(leaks, 0, '% of the leakage')}, and 10 % of the leakage cost the table {both(_of(ten, 'table'))} a "
        "cycle.",
        Verdict.of(min(_of(ten, "table").values()) > 2.0),
    )


def _share_of(unit: HydraulicUnit) -> float:
    """One point of volumetric efficiency as a share of the held side's pump's losses [1]."""
    held = {f"pump_{'a' if unit.lift_sign > 0.0 else 'b'}"}
    losses = [1.0 - part.volumetric_efficiency for part in unit.parts() if isinstance(part, Pump) and part.name in held]
    return 0.01 / losses[0]


def _at(found: Found, sensor: str, where: float) -> dict[str, float]:
    """Magnitude of a sensor's error by unit [mm]."""
    return {unit: abs(by[sensor][where]) for unit, by in found.items()}


def _of(slope: dict[str, dict[str, float]], sensor: str) -> dict[str, float]:
    return {unit: abs(by[sensor]) for unit, by in slope.items()}


def _draw(figure: Any, found: Found, label: str) -> None:
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (unit, sensors) in zip(panels, found.items(), strict=True):
        for name, look in _LOOKS.items():
            by = sensors[name]
            axes.plot(
                list(by),
                np.array(list(by.values())),
                look.style,
                marker="o",
                color=look.colour,
                lw=_WIDTHS[name],
                label=look.name,
            )
        axes.axhline(0.0, color=TRUTH, lw=0.6)
        axes.set(xlabel=label, title=unit)
    panels[0].set_ylabel("error after the cycle,\ntowards lifting [mm]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, ncols=4, loc="outside lower center", fontsize=8)
