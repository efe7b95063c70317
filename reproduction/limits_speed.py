"""Speeds other than the table's own, and what tables at several speeds mend."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ramsight import simulate
from ramsight.units import RPM
from reproduction.bench import TABLE_SPEEDS, Bench
from reproduction.chapter import Chapter, Picture, Statement, Verdict
from reproduction.figure_style import GREY, SENSORS, SPEED_TABLE, TRUTH, Look
from reproduction.words import both

SPEEDS_RPM = (300, 400, 500, 750, 1000, 1250, 1500, 1750, 2000, 2500, 3000)
_OWN = 1500  # rpm; the table's
_TRAVEL = 0.2  # share of the stroke that a move without leakage goes
LOOKS = {
    "table": Look("table at 1500 rpm", SENSORS["table"].colour, "-"),
    "speed_table": Look("six tables, over n", GREY, ":"),
    "reciprocal_table": Look("six tables, over 1/n", SPEED_TABLE, "-"),
    "balance": SENSORS["balance"],
    "kalman": SENSORS["kalman"],
}
"""Every sensor that is compared over speeds and ramps."""


def cycle_errors(bench: Bench, *, motor_speed: float, start: float, ramp: float | None = None) -> dict[str, float]:
    """Largest error of one cycle at the high load [mm], by sensor; moves are equally long at all speeds.

    Args:
        bench: the unit.
        motor_speed: [rad/s].
        start: share of the stroke; chosen so that no stop is touched.
        ramp: [s]; by default the bench's.
    """
    hold = _TRAVEL * bench.unit.cylinder.stroke / (motor_speed * bench.unit.travel_per_radian)
    duty = bench.cycle(bench.loads["high"], motor_speed=motor_speed, hold=hold, start=start, ramp=ramp)
    run = simulate(bench.unit, duty)
    return {name: bench.track(run, sensor).largest_mm for name, sensor in (bench.sensors | bench.speed_tables).items()}


def speeds(benches: dict[str, Bench]) -> Chapter:
    """Speeds other than the calibrated one."""
    found = {
        unit: {rpm: cycle_errors(bench, motor_speed=rpm * RPM, start=0.5) for rpm in SPEEDS_RPM}
        for unit, bench in benches.items()
    }
    return Chapter(
        "Other speeds than the table's own",
        _text(found),
        {
            "other_speeds_error_mm": {
                unit: {f"{rpm}_rpm": errors for rpm, errors in by_speed.items()} for unit, by_speed in found.items()
            }
        },
        (_method(found),),
        (
            Picture(
                "fig19_speeds",
                "Largest error of one cycle at high load over the motor's speed. The single table was made at 1500 "
                "rpm, as the paper made its own.",
                lambda figure: _draw(figure, found, "motor speed [rpm]", mark=_OWN),
                (7.2, 3.8),
            ),
        ),
    )


def _text(found: dict[str, dict[int, dict[str, float]]]) -> tuple[str, ...]:
    def at(rpm: int, sensor: str) -> dict[str, float]:
        return {unit: by[rpm][sensor] for unit, by in found.items()}

    worst = {s: {unit: max(e[s] for e in by.values()) for unit, by in found.items()} for s in LOOKS}
    speeds = ", ".join(f"{speed / RPM:.0f}" for speed in TABLE_SPEEDS)
    return (
        "The paper drives its units at one constant speed and claims nothing for others. Leakage is per second, so "
        "that a table per revolution belongs to the speed of its calibration. The same moves at high load and 40 °C "
        f"cost {both(at(500, 'table'), 0)} at 500 rpm and {both(at(3000, 'table'), 0)} at 3000 rpm.",
        f"The method is not at its end there. Tables at {speeds} rpm hold between these speeds, if they are "
        "interpolated as the movement goes. What leaks makes a movement per revolution in proportion to 1/n. Over 1/n "
        f"they err by {both(at(750, 'reciprocal_table'))} at 750 rpm and by {both(worst['reciprocal_table'])} at "
        f"worst. Over n, which is the nearest thought, it is {both(at(750, 'speed_table'))} at 750 rpm. They take six "
        f"times the calibration. The balance stays within {both(worst['balance'])}, the self-calibrating sensor within "
        f"{both(worst['kalman'])}, without any table.",
    )


def _method(found: dict[str, dict[int, dict[str, float]]]) -> Statement:
    own = {unit: by[_OWN]["table"] for unit, by in found.items()}
    worst = {unit: max(e["reciprocal_table"] for e in by.values()) for unit, by in found.items()}
    return Statement(
        "Section 3",
        "The position calculation is based on look-up tables of the movement per revolution over torque at various "
        "temperatures.",
        f"At the speed of the table the method does what the paper says of it ({both(own)} in these shorter cycles). "
        "For other speeds, of which the paper does not speak, the speed has to be a third axis. Six tables over 1/n "
        f"stay within {both(worst)}.",
        Verdict.of(max(worst.values()) < 10.0),
    )


def values(by_key: dict[Any, dict[str, float]], sensor: str) -> NDArray[np.float64]:
    """Errors of a sensor [mm], in the order of the keys."""
    return np.array([errors[sensor] for errors in by_key.values()])


def _draw(figure: Any, found: dict[str, dict[int, dict[str, float]]], label: str, *, mark: float) -> None:
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (unit, by_key) in zip(panels, found.items(), strict=True):
        for sensor, look in LOOKS.items():
            axes.plot(list(by_key), values(by_key, sensor), look.style, marker="o", color=look.colour, label=look.name)
        axes.axvline(mark, color=TRUTH, lw=0.8, ls=":")
        axes.set(xlabel=label, title=unit, yscale="log")
    panels[0].set_ylabel("largest error of a cycle [mm]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, ncols=5, loc="outside lower center", fontsize=8)
