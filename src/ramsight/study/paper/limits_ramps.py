"""Where the paper's error comes from: the ramps, explained and checked."""

from __future__ import annotations

from typing import Any

from ramsight.duty.lift_lower import RAMP, SPEED
from ramsight.plant.steady import torque_at_load
from ramsight.plant.unit import HydraulicUnit
from ramsight.study.paper.bench import TEMPERATURE, Bench
from ramsight.study.paper.drawing import TRUTH
from ramsight.study.paper.limits_speed import SENSORS, cycle_errors, values
from ramsight.study.paper.parts import Chapter, Picture, Statement, Verdict

RAMPS = (0.1, 0.2, 0.4, 0.8, 1.2, 1.6, 2.4, 3.2)  # s
_CLOSE = 0.15  # largest part by which simulated and explained error may differ


def leak_velocity(unit: HydraulicUnit, load: float) -> float:
    """Rod velocity that the leakage takes from lifting and adds to lowering [m/s], mean of both.

    Args:
        unit: the unit.
        load: [N].

    Example:
        >>> from ramsight.study.paper.bench import benches
        >>> boom = benches()["boom"]
        >>> round(1e3 * leak_velocity(boom.unit, boom.loads["high"]), 2)
        3.0
    """
    point = torque_at_load(unit, load, TEMPERATURE, SPEED)
    return SPEED * 0.5 * (point.travel_lower - point.travel_lift)


def ramps(benches: dict[str, Bench]) -> Chapter:
    """The paper's error explained by the ramps, and checked."""
    found = {
        unit: {ramp: cycle_errors(bench, motor_speed=SPEED, ramp=ramp, start=0.25) for ramp in RAMPS}
        for unit, bench in benches.items()
    }
    leak = {unit: leak_velocity(bench.unit, bench.loads["high"]) for unit, bench in benches.items()}
    explained = {unit: {ramp: 4 * 0.5 * 1e3 * v * ramp for ramp in RAMPS} for unit, v in leak.items()}
    off = {
        unit: max(abs(found[unit][r]["table"] / explained[unit][r] - 1.0) for r in RAMPS if r >= RAMP) for unit in found
    }
    return Chapter(
        "Where the paper's error comes from: the ramps",
        (
            "At constant speed the table is right. In a ramp of length t the mean speed is half the calibrated one, "
            "so the leakage of half the ramp is missing: ½·v_leak·t, four times a cycle, always with the load. With "
            f"v_leak = {1e3 * leak['boom']:.2f} mm/s (boom) and {1e3 * leak['bucket']:.2f} mm/s (bucket) at high "
            f"load, four ramps of 0.8 s make {explained['boom'][RAMP]:.1f} and {explained['bucket'][RAMP]:.1f} mm; "
            f"simulated are {found['boom'][RAMP]['table']:.1f} and {found['bucket'][RAMP]['table']:.1f} mm. The "
            "paper names about 5 and 10 mm.",
            "While the motor turns too slowly to hold the load the safety valve is closed and nothing is lost, "
            "which takes a little off the explained error; the shorter the ramp, the more the chamber's compression "
            "counts.",
        ),
        {
            "ramp_error_mm": {
                unit: {
                    f"{ramp:g}_s": {**errors, "explained": explained[unit][ramp]} for ramp, errors in by_ramp.items()
                }
                for unit, by_ramp in found.items()
            },
            "leak_velocity_mm_per_s": {unit: 1e3 * v for unit, v in leak.items()},
            "ramp_explanation_off_share": off,
        },
        (
            Statement(
                "Discussion",
                "The accumulation of error is mainly caused by errors induced during the motor's acceleration and "
                "deceleration phases.",
                f"½·v_leak·t_ramp in each ramp gives the simulated error to within {100 * max(off.values()):.0f} % "
                "for ramps from 0.8 to 3.2 s, both units.",
                Verdict.of(max(off.values()) < _CLOSE),
            ),
        ),
        (
            Picture(
                "fig20_ramps",
                "Largest error of one cycle at high load over the length of its four ramps: simulated (marks) and "
                "explained by ½·v_leak·t_ramp each (lines).",
                lambda figure: _draw_ramps(figure, found, explained),
                (7.2, 3.6),
            ),
        ),
    )


def _draw_ramps(
    figure: Any, found: dict[str, dict[float, dict[str, float]]], explained: dict[str, dict[float, float]]
) -> None:
    panels = figure.subplots(1, 2)
    for axes, (unit, by_ramp) in zip(panels, found.items(), strict=True):
        axes.plot(list(explained[unit]), list(explained[unit].values()), color=TRUTH, lw=1.0, label="explained")
        for sensor, (name, colour) in SENSORS.items():
            style = "o" if sensor == "table" else "o-"
            axes.plot(list(by_ramp), values(by_ramp, sensor), style, color=colour, lw=0.8, label=name)
        axes.set(xlabel="length of each ramp [s]", title=unit, ylim=(0, None), xlim=(0, None))
    panels[0].set_ylabel("largest error of a cycle [mm]")
    panels[0].legend(fontsize=8)
