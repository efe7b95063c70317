"""Where the paper's error comes from: the ramps, explained and checked; and what of it is a prediction."""

from __future__ import annotations

from typing import Any

import numpy as np

from ramsight.duty.lift_lower import RAMP, SPEED
from ramsight.plant.steady import torque_at_load
from ramsight.plant.unit import HydraulicUnit
from reproduction.bench import TEMPERATURE, Bench
from reproduction.chapter import Chapter, Picture, Statement, Verdict
from reproduction.cycles import LIMITS_MM
from reproduction.figure_style import TRUTH
from reproduction.limits_speed import LOOKS, cycle_errors, values
from reproduction.words import both

RAMPS = (0.1, 0.2, 0.4, 0.8, 1.2, 1.6, 2.4, 3.2)  # s
_COMPRESSES = 0.4  # s; in shorter ramps the oil's compression is as much as what leaks
_CLOSE = 0.15  # largest part by which simulated and explained error, or ratio and the paper's ratio, may differ

Errors = dict[str, dict[float, dict[str, float]]]
Explained = dict[str, dict[float, float]]


def leak_velocity(unit: HydraulicUnit, load: float) -> float:
    """Rod velocity that the leakage takes from lifting and adds to lowering [m/s], mean of both.

    Args:
        unit: the unit.
        load: [N].

    Example:
        >>> from reproduction.bench import benches
        >>> boom = benches()["boom"]
        >>> round(1e3 * leak_velocity(boom.unit, boom.loads["high"]), 2)
        3.0
    """
    point = torque_at_load(unit, load, TEMPERATURE, SPEED)
    return SPEED * 0.5 * (point.travel_lower - point.travel_lift)


def ramps(benches: dict[str, Bench]) -> Chapter:
    """The paper's error explained by the ramps, and checked."""
    found = {
        unit: {
            ramp: cycle_errors(bench, motor_speed=SPEED, start=0.25, ramp=ramp) for ramp in RAMPS
        }
        for unit, bench in benches.items()
    }  # fmt: skip
    leak = {unit: leak_velocity(bench.unit, bench.loads["high"]) for unit, bench in benches.items()}
    explained = {unit: {ramp: 4 * 0.5 * 1e3 * v * ramp for ramp in RAMPS} for unit, v in leak.items()}
    off = {
        unit: max(abs(found[unit][r]["table"] / explained[unit][r] - 1.0) for r in RAMPS if r >= RAMP) for unit in found
    }
    ratio = {ramp: found["bucket"][ramp]["table"] / found["boom"][ramp]["table"] for ramp in RAMPS}
    fits = {unit: _ramp_for(found[unit], LIMITS_MM[unit]) for unit in found}
    return Chapter(
        "Where the paper's error comes from: the ramps",
        _text(found, explained, leak, ratio, fits),
        {
            "ramp_error_mm": {
                unit: {
                    f"{ramp:g}_s": {**errors, "explained": explained[unit][ramp]} for ramp, errors in by_ramp.items()
                }
                for unit, by_ramp in found.items()
            },
            "leak_velocity_mm_per_s": {unit: 1e3 * v for unit, v in leak.items()},
            "ramp_explanation_off_share": off,
            "ratio_of_bucket_to_boom": {f"{ramp:g}_s": value for ramp, value in ratio.items()},
            "ramp_that_gives_the_papers_error_s": fits,
        },
        (_ratio(ratio, fits), _cause(off)),
        (
            Picture(
                "fig20_ramps",
                "Largest error of one cycle at high load over the length of its four ramps: simulated (marks) and "
                "explained by ½·v_leak·t_ramp each (line). Dotted: the paper's error.",
                lambda figure: _draw_ramps(figure, found, explained),
                (7.2, 3.8),
            ),
        ),
    )


def _ramp_for(by_ramp: dict[float, dict[str, float]], error: float) -> float:
    """The ramp [s] with which the table errs by so much [mm]."""
    return float(np.interp(error, values(by_ramp, "table"), list(by_ramp)))


def _text(
    found: Errors, explained: Explained, leak: dict[str, float], ratio: dict[float, float], fits: dict[str, float]
) -> tuple[str, ...]:
    longer = [value for ramp, value in ratio.items() if ramp >= RAMP]
    return (
        "At constant speed the table is right. In a ramp of length t the mean speed is half the calibrated one, "
        "so the leakage of half the ramp is missing. That is ½·v_leak·t, four times a cycle, always with the load. "
        "With "
        f"v_leak = {both({u: 1e3 * v for u, v in leak.items()}, 2, 'mm/s')} at high load, four ramps of {RAMP:g} s "
        f"make {both({u: by[RAMP] for u, by in explained.items()})}. Simulated are "
        f"{both({u: by[RAMP]['table'] for u, by in found.items()})}. The paper names about 5 and 10 mm.",
        "The paper does not say how long its ramps are, and the error is in proportion to them: the absolute figures "
        f"are no test of anything. Ramps of {both(fits, 2, 's')} would give just 5 and 10 mm. What is predicted is "
        "that one ramp serves both units, that is their ratio. Bucket over boom is "
        f"{ratio[RAMP]:.2f} with ramps of {RAMP:g} s, {min(longer):.2f} to {max(longer):.2f} with longer ones, and 2 "
        f"in "
        f"the paper. Of ramps below {_COMPRESSES:g} s it says nothing: there the oil's compression rules.",
        "While the motor turns too slowly to hold the load the safety valve is closed and nothing is lost, "
        "which takes a little off the explained error. The shorter the ramp, the more the chamber's compression "
        "counts.",
    )


def _ratio(ratio: dict[float, float], fits: dict[str, float]) -> Statement:
    longer = [value for ramp, value in ratio.items() if ramp >= RAMP]
    return Statement(
        "Conclusion",
        "The errors of boom and bucket at high load are as 5 to 10.",
        f"As 1 to {ratio[RAMP]:.1f} with ramps of {RAMP:g} s, 1 to {min(longer):.2f} ... {max(longer):.2f} with longer "
        f"ones. This is not fitted: one ramp serves both units ({both(fits, 2, 's')} for exactly 5 and 10 mm).",
        Verdict.of(max(abs(value / 2.0 - 1.0) for value in longer) < _CLOSE),
    )


def _cause(off: dict[str, float]) -> Statement:
    return Statement(
        "Discussion",
        "The accumulation of error is mainly caused by errors induced during the motor's acceleration and "
        "deceleration phases.",
        f"½·v_leak·t_ramp in each ramp gives the simulated error to within {100 * max(off.values()):.0f} % "
        f"for ramps from {RAMP:g} to {max(RAMPS):g} s, both units.",
        Verdict.of(max(off.values()) < _CLOSE),
    )


def _draw_ramps(figure: Any, found: Errors, explained: Explained) -> None:
    panels = figure.subplots(1, 2)
    for axes, (unit, by_ramp) in zip(panels, found.items(), strict=True):
        axes.plot(list(explained[unit]), list(explained[unit].values()), color=TRUTH, lw=1.0, label="explained")
        axes.axhline(LIMITS_MM[unit], color=TRUTH, lw=0.8, ls=":")
        for sensor, look in LOOKS.items():
            style = "none" if sensor == "table" else look.style
            axes.plot(
                list(by_ramp), values(by_ramp, sensor), ls=style, marker="o", color=look.colour, lw=0.8, label=look.name
            )
        axes.set(xlabel="length of each ramp [s]", title=unit, ylim=(0, None), xlim=(0, None))
    panels[0].set_ylabel("largest error of a cycle [mm]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, ncols=3, loc="outside lower center", fontsize=8)
