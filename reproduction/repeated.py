"""Repeated cycles: how the error grows over fifty, and what proximity switches or the end stop make of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from reproduction.bench import Bench
from reproduction.chapter import Chapter, Grid, Picture, Statement, Verdict
from reproduction.figure_style import GREY, SENSORS
from reproduction.repeating import CYCLES, NAMES, SWITCHES, Repeated, repeat
from reproduction.words import both, figure

Results = dict[str, dict[str, dict[str, Repeated]]]
"""By unit, sensor and kind of reference."""
_GONE = 0.05  # mm a cycle; less is no drift
_UNIT_STYLES = {"boom": "-", "bucket": "--"}


def repeated(benches: dict[str, Bench]) -> Chapter:
    """Chapter on cycles that are repeated."""
    both_found = {name: repeat(bench) for name, bench in benches.items()}
    found: Results = {unit: results for unit, (results, _) in both_found.items()}
    accuracy = {unit: own for unit, (_, own) in both_found.items()}
    drift = {
        sensor: {unit: {kind: r.drift for kind, r in by[sensor].items()} for unit, by in found.items()}
        for sensor in SENSORS
    }
    numbers = {
        unit: {
            **{s: {k: r.numbers for k, r in kinds.items()} for s, kinds in results.items()},
            "switch_accuracy_mm": accuracy[unit],
        }
        for unit, results in found.items()
    }
    return Chapter(
        "Repeated cycles and references",
        _text(found, accuracy),
        {"drift_mm_per_cycle": drift, "repeated_cycles": numbers},
        (_accumulates(found, drift), _switches_help(found, accuracy)),
        (
            Picture(
                "fig17_drift",
                f"Error after each of {CYCLES} cycles without any reference.",
                lambda figure: _draw_drift(figure, found),
                (7.2, 3.6),
            ),
            Picture(
                "fig18_references",
                "Error after each cycle with proximity switches and with the end stop. Thin grey: the same without any "
                "reference.",
                lambda figure: _draw_references(figure, found),
                (9.0, 5.0),
            ),
        ),
        (_grid(found),),
    )


def _text(found: Results, accuracy: dict[str, float]) -> tuple[str, ...]:
    stop = {unit: by["table"]["stop"].largest for unit, by in found.items()}
    own = {unit: by["kalman"]["stop"].largest for unit, by in found.items()}
    return (
        f"Each unit lifts and lowers its high load {CYCLES} times between 2 and 98 % of its stroke, in cycles "
        "that end where they began. The switches have a hysteresis of 1 mm and a response time of 5 ms, and are "
        f"seen at the next sample of the drive. So their own accuracy is {both(accuracy)} at the highest rod "
        "speed.",
        "The end stop shows in the torque alone: while the unit lowers, the load's torque collapses when the "
        "rod stands on its stop. For table and balance it is looked for there, and the position is then that of the "
        "stop. What remains is the give of the stop under the load, and the oil that has to fill the emptied chamber "
        f"before the next lift. The table takes that for travel: up to {both(stop)}. The self-calibrating sensor "
        f"finds the stop by itself: up to {both(own)}.",
    )


def _accumulates(found: Results, drift: dict[str, dict[str, dict[str, float]]]) -> Statement:
    per_cycle = {s: {unit: abs(by[unit]["none"]) for unit in found} for s, by in drift.items()}
    last = {unit: float(by["table"]["none"].after_cycle[-1]) for unit, by in found.items()}
    return Statement(
        "Abstract",
        "A cumulative error was observed for repeated cycles.",
        f"The table drifts by {both(per_cycle['table'], 2)} per cycle, to {both(last, 0)} after {CYCLES}. On machines "
        f"that are their data sheets the balance drifts by {both(per_cycle['balance'], 3)} per cycle. The "
        f"self-calibrating sensor without references drifts by {both(per_cycle['kalman'], 3)}. It learns leakage "
        "from the stops of the motor to a few per cent, and a data sheet that is exact needs no learning.",
        Verdict.of(min(per_cycle["table"].values()) > 1.0),
    )


def _switches_help(found: Results, accuracy: dict[str, float]) -> Statement:
    kept = {unit: max(by["table"][kind].left for kind in SWITCHES) for unit, by in found.items()}
    within = all(
        by[sensor][kind].left <= accuracy[unit]
        for unit, by in found.items()
        for sensor in ("table", "balance")
        for kind in SWITCHES
    )
    bounded = all(abs(by["table"][kind].drift) < _GONE for by in found.values() for kind in SWITCHES)
    return Statement(
        "Abstract, discussion",
        "Simple proximity sensors at the cylinder's end or middle resolve the accumulation.",
        f"With one switch the drift is gone (below {_GONE:g} mm per cycle); a visit leaves at most {both(kept)}, less "
        "than the switch's own accuracy. Between visits the table's error of the cycle comes back each time.",
        Verdict.of(within and bounded),
    )


def _grid(found: Results) -> Grid:
    head = ["unit and reference"]
    for look in SENSORS.values():
        head += [f"{look.name}: drift", f"after {CYCLES}", "largest"]
    rows = tuple(
        (f"{unit}, {NAMES[kind]}", *(cell for sensor in SENSORS for cell in _cells(by[sensor][kind])))
        for unit, by in found.items()
        for kind in NAMES
    )
    return Grid(f"Drift per cycle, error after {CYCLES} cycles and largest error at any time [mm]", tuple(head), rows)


def _cells(one: Repeated) -> tuple[str, str, str]:
    return figure(one.drift, 3), figure(one.after_cycle[-1]), figure(one.largest)


def _draw_drift(figure: Any, found: Results) -> None:
    axes = figure.add_subplot()
    for unit, style in _UNIT_STYLES.items():
        for sensor, look in SENSORS.items():
            error = found[unit][sensor]["none"].after_cycle
            axes.plot(np.arange(1, len(error) + 1), error, style, color=look.colour, label=f"{look.name}, {unit}")
    axes.set(xlabel="cycle", ylabel="error after the cycle [mm]", yscale="log", xlim=(1, CYCLES))
    axes.legend(ncols=3, loc="upper center", bbox_to_anchor=(0.5, 1.16), fontsize=8)


def _draw_references(figure: Any, found: Results) -> None:
    grid = figure.subplots(2, len(SENSORS), sharex=True, sharey="row")
    styles = {"end": ("-", 1.6), "middle": ("--", 1.2), "both_ends": (":", 2.4), "stop": ("-.", 1.0)}
    number = np.arange(1, CYCLES + 1)
    for row, (unit, by) in zip(grid, found.items(), strict=True):
        top = max(r.after_cycle.max() for s in by.values() for k, r in s.items() if k != "none")
        for axes, (sensor, look) in zip(row, SENSORS.items(), strict=True):
            axes.plot(number, by[sensor]["none"].after_cycle, color=GREY, lw=0.8)
            for kind, (style, width) in styles.items():
                axes.plot(number, by[sensor][kind].after_cycle, style, color=look.colour, lw=width)
            axes.set(title=f"{unit}, {look.name}", ylim=(0, 1.15 * top), xlim=(1, CYCLES))
        row[0].set_ylabel("error after\nthe cycle [mm]")
    for axes in grid[-1]:
        axes.set_xlabel("cycle")
    names = [grid[0, 0].plot([], [], color=GREY, lw=0.8)[0]]
    names += [grid[0, 0].plot([], [], style, color="0.25", lw=width)[0] for style, width in styles.values()]
    figure.legend(names, [NAMES["none"], *(NAMES[kind] for kind in styles)], ncols=3, loc="outside lower center")
