"""Machines that are not their data sheet: what each difference costs each sensor, and which of it can be learned."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from ramsight import AsBuilt, simulate
from reproduction.bench import Bench
from reproduction.chapter import Chapter, Grid, Statement, Verdict
from reproduction.figure_style import SENSORS
from reproduction.limits_state import TAUGHT, warmer
from reproduction.taught import START, VISITS, taught_mm
from reproduction.words import both, figure

if TYPE_CHECKING:
    import xarray

Change = Callable[["xarray.Dataset"], "xarray.Dataset"]


def _stronger(log: xarray.Dataset, by: float) -> xarray.Dataset:
    """A log whose torques read too high by a share."""
    changed = log.copy()
    changed["motor_torque"] = log["motor_torque"] * (1.0 + by)
    return changed


MACHINES: dict[str, tuple[AsBuilt, Change | None]] = {
    "as the data sheet": (AsBuilt(), None),
    "leakage +10 %": (AsBuilt(leak=1.1), None),
    "leakage +50 %": (AsBuilt(leak=1.5), None),
    "displacement -0.5 %": (AsBuilt(displacement=0.995), None),
    "oil and hoses 30 % softer": (AsBuilt(stiffness=0.7), None),
    "friction twice as high": (AsBuilt(friction=2.0), None),
    "temperature read 3 K too high": (AsBuilt(), partial(warmer, by=3.0)),
    "torque read 3 % too high": (AsBuilt(), partial(_stronger, by=0.03)),
    "leakage +20 %, displacement -0.5 %, softer, 3 K": (
        AsBuilt(leak=1.2, displacement=0.995, stiffness=0.8),
        partial(warmer, by=3.0),
    ),
}
"""Machines and their logs by what is different: within what data sheets of pumps, drives and thermometers allow."""
_FRICTION = "friction twice as high"


def as_built(benches: dict[str, Bench]) -> Chapter:
    """One cycle of each machine, with sensors made for the data sheet."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for unit, bench in benches.items():
        for name, (built, change) in MACHINES.items():
            found.setdefault(unit, {})[name] = _errors(bench, built, change)
    head = ("machine", *(look.name for look in SENSORS.values()), f"self-calibrating, after {VISITS} stops")
    rows = tuple(
        (f"{unit}, {name}", *(figure(errors[sensor], 2) for sensor in (*SENSORS, TAUGHT)))
        for unit, by in found.items()
        for name, errors in by.items()
    )
    worst = {s: {unit: max(e[s] for e in by.values()) for unit, by in found.items()} for s in (*SENSORS, TAUGHT)}
    return Chapter(
        "Machines that are not their data sheet",
        (
            "No machine is its data sheet. In this table each is different in one thing, the last in several, and all "
            "sensors are made for the data sheet and know the position before the cycle. Only the last column is "
            f"the self-calibrating sensor that started without a position and has met {VISITS} end stops. On these "
            f"machines the balance errs by up to {both(worst['balance'])} in a cycle, the table by up to "
            f"{both(worst['table'])}. Counting the oil alone is no answer. Learning is: {both(worst[TAUGHT])}.",
        ),
        {"not_the_data_sheet_error_mm": found},
        (_friction(found),),
        grids=(Grid("Largest error of one cycle at high load, 40 °C [mm]", head, rows),),
    )


def _errors(bench: Bench, built: AsBuilt, change: Change | None) -> dict[str, float]:
    """Largest error of one cycle [mm], by sensor."""
    actual = built.apply(bench.unit)
    run = simulate(actual, bench.cycle(bench.loads["high"], of=actual, start=START))
    errors = {name: bench.track(run, sensor, add=change).largest_mm for name, sensor in bench.sensors.items()}
    return errors | {TAUGHT: taught_mm(bench, actual, add=change)}


def _friction(found: dict[str, dict[str, dict[str, float]]]) -> Statement:
    more = {unit: abs(by[_FRICTION]["table"] - by["as the data sheet"]["table"]) for unit, by in found.items()}
    return Statement(
        "Discussion",
        "The cylinder friction is scaled from a smaller cylinder, which is likely to give inaccurate values.",
        f"It matters little: friction twice as high changes the table's error of a cycle by {both(more, 2)}.",
        Verdict.of(max(more.values()) < 1.0),
    )
