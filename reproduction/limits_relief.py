"""Loads near and above what the relief valve holds."""

from __future__ import annotations

from typing import Any

import numpy as np

from ramsight import Status, simulate
from ramsight.plant.steady import derive
from reproduction.bench import Bench
from reproduction.chapter import Chapter, Picture, Statement, Verdict
from reproduction.figure_style import SENSORS
from reproduction.taught import START
from reproduction.words import both

SHARES = (0.80, 0.85, 0.90, 0.93, 0.96, 0.98, 0.99, 1.0, 1.01, 1.02, 1.04)
_WRONG_MM = {"boom": 5.0, "bucket": 10.0}  # what the paper has at its high load; more has to be flagged
_MORE = 1.3  # times that, at loads above it
_LEAST_DRAWN = 1e-2  # mm

ByShare = dict[str, dict[str, dict[float, float]]]
"""Errors [mm] by unit, sensor and share of the load at relief."""


def near_relief(benches: dict[str, Bench]) -> Chapter:
    """Loads near and above what the relief valve allows."""
    errors: ByShare = {}
    unflagged: ByShare = {}
    for unit, bench in benches.items():
        errors[unit], unflagged[unit] = _cycles(bench)
    silent = {unit: max(max(by.values()) for by in sensors.values()) for unit, sensors in unflagged.items()}
    return Chapter(
        "Near the relief pressure",
        _text(errors, silent),
        {
            "near_relief_error_mm": {u: {s: _named(by) for s, by in sensors.items()} for u, sensors in errors.items()},
            "near_relief_error_called_ok_mm": {
                u: {s: _named(by) for s, by in sensors.items()} for u, sensors in unflagged.items()
            },
            "largest_error_called_ok_near_relief_mm": silent,
        },
        (_no_longer_valid(errors, silent),),
        (
            Picture(
                "fig24_relief",
                "Largest error of one cycle over the load, as a share of the load at the relief pressure: of all "
                "samples, and of those that the sensor called ok.",
                lambda figure: _draw(figure, errors, unflagged),
                (7.2, 3.8),
            ),
        ),
    )


def _cycles(bench: Bench) -> tuple[dict[str, dict[float, float]], dict[str, dict[float, float]]]:
    """Largest errors [mm] of all samples, and of those called ok, by sensor and share of the load at relief."""
    errors: dict[str, dict[float, float]] = {name: {} for name in bench.sensors}
    called_ok: dict[str, dict[float, float]] = {name: {} for name in bench.sensors}
    limit = derive(bench.unit).load_at_relief
    for share in SHARES:
        run = simulate(bench.unit, bench.cycle(share * limit, start=START))
        for name, sensor in bench.sensors.items():
            tracked = bench.track(run, sensor)
            sure = tracked.status == Status.OK
            errors[name][share] = tracked.largest_mm
            called_ok[name][share] = float(1e3 * np.abs(tracked.error[sure]).max()) if sure.any() else 0.0
    return errors, called_ok


def _worst(errors: ByShare, sensor: str) -> dict[str, float]:
    return {unit: max(by[sensor].values()) for unit, by in errors.items()}


def _text(errors: ByShare, silent: dict[str, float]) -> tuple[str, ...]:
    return (
        "Above about 97 % of the load that the relief valve holds, part of the pump's flow goes to the tank and "
        f"the calculated movement has nothing to do with the true one. The error is up to "
        f"{both(_worst(errors, 'table'), 0)} for "
        f"the table, in one cycle. The balance counts oil that is no longer there, and errs by up to "
        f"{both(_worst(errors, 'balance'), 0)}{_worse(errors)}. The self-calibrating sensor errs by up to "
        f"{both(_worst(errors, 'kalman'), 0)}. None of them knows where the oil went.",
        "They say so. From 97 % of the opening pressure or torque on they call themselves uncertain. Once the "
        "valve has passed oil they call the position lost, or uncertain by what may have passed, until a reference "
        f"comes. The largest error of any sample that was called ok is {both(silent)}.",
    )


def _worse(errors: ByShare) -> str:
    """On which units the balance does worse than the table."""
    table, balance = _worst(errors, "table"), _worst(errors, "balance")
    units = [unit for unit in errors if balance[unit] > table[unit]]
    return f" (on the {' and the '.join(units)} more than the table)" if units else ""


def _no_longer_valid(errors: ByShare, silent: dict[str, float]) -> Statement:
    worst = {sensor: _worst(errors, sensor) for sensor in ("table", "balance")}
    holds = all(worst["table"][u] > 10 * wrong and silent[u] <= _MORE * wrong for u, wrong in _WRONG_MM.items())
    return Statement(
        "Section 2, conclusion",
        "Near and over the maximum pressure the position calculation is no longer valid; it takes a reference.",
        f"The table errs by up to {both(worst['table'], 0)}, the balance by up to {both(worst['balance'], 0)}. Every "
        "sample worse than the paper's error at high load carries a status that says so.",
        Verdict.of(holds),
    )


def _named(by: dict[float, float]) -> dict[str, float]:
    return {f"{100 * share:.0f}_percent": value for share, value in by.items()}


def _draw(figure: Any, errors: ByShare, unflagged: ByShare) -> None:
    panels = figure.subplots(1, 2, sharey=True)
    for axes, unit in zip(panels, errors, strict=True):
        for sensor, look in SENSORS.items():
            share = 100 * np.array(list(errors[unit][sensor]))
            axes.plot(share, list(errors[unit][sensor].values()), color=look.colour, label=f"{look.name}, all samples")
            called = np.maximum(np.array(list(unflagged[unit][sensor].values())), _LEAST_DRAWN)
            axes.plot(share, called, "o:", color=look.colour, lw=1.0, label=f"{look.name}, called ok")
        axes.set(xlabel="load [% of that at relief]", title=unit, yscale="log")
    panels[0].set_ylabel("largest error [mm]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, ncols=3, loc="outside lower center", fontsize=8)
