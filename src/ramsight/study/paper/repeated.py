"""Repeated cycles: how the error grows over fifty, and what proximity switches or the end stop make of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ramsight.study.paper.bench import Bench
from ramsight.study.paper.drawing import BALANCE, ESTIMATE, GREY
from ramsight.study.paper.parts import Chapter, Grid, Picture, Statement, Verdict
from ramsight.study.paper.repeating import CYCLES, NAMES, SWITCHES, Repeated, repeat


def repeated(benches: dict[str, Bench]) -> Chapter:
    """The repeated-cycle study."""
    found = {name: repeat(bench) for name, bench in benches.items()}
    drift = {
        sensor: {unit: {kind: r.drift for kind, r in results[sensor].items()} for unit, (results, _) in found.items()}
        for sensor in ("table", "balance")
    }
    numbers = {
        unit: {
            **{s: {k: r.numbers for k, r in kinds.items()} for s, kinds in results.items()},
            "switch_accuracy_mm": accuracy,
        }
        for unit, (results, accuracy) in found.items()
    }
    rows = tuple(
        (
            f"{unit}, {NAMES[kind]}",
            *(
                f"{round(value, digits) + 0.0:.{digits}f}"
                for sensor in ("table", "balance")
                for value, digits in (
                    (results[sensor][kind].drift, 3),
                    (results[sensor][kind].after_cycle[-1], 1),
                    (results[sensor][kind].largest, 1),
                )
            ),
        )
        for unit, (results, _) in found.items()
        for kind in NAMES
    )
    kept = {unit: max(results["table"][kind].left for kind in SWITCHES) for unit, (results, _) in found.items()}
    holds = all(
        results[sensor][kind].left <= accuracy
        for results, accuracy in found.values()
        for sensor in results
        for kind in SWITCHES
    )
    bounded = all(abs(results["table"][k].drift) < 0.05 for results, _ in found.values() for k in SWITCHES)
    stop = {unit: results["table"]["stop"] for unit, (results, _) in found.items()}
    return Chapter(
        "Repeated cycles and references",
        (
            f"Each unit lifts and lowers its high load {CYCLES} times between 2 and 98 % of its stroke, in cycles "
            "that end where they began. The switches have a hysteresis of 1 mm and a response time of 5 ms, and are "
            "seen at the next sample of the drive, so that their own accuracy is "
            + " and ".join(f"{accuracy:.1f} mm ({unit})" for unit, (_, accuracy) in found.items())
            + " at the highest rod speed.",
            "The end stop is found in the torque alone: while the unit lowers, the load's torque collapses when the "
            "rod stands on its stop. The position is then that of the stop; what remains is the give of the stop "
            "under the load, and the oil that has to fill the emptied chamber before the next lift, which the table "
            f"takes for travel: up to {stop['boom'].largest:.1f} mm (boom) and {stop['bucket'].largest:.1f} mm "
            "(bucket).",
        ),
        {"drift_mm_per_cycle": drift, "repeated_cycles": numbers},
        (
            Statement(
                "Abstract",
                "A cumulative error was observed for repeated cycles.",
                f"The table drifts by {drift['table']['boom']['none']:.2f} mm (boom) and "
                f"{drift['table']['bucket']['none']:.2f} mm (bucket) per cycle, to {stop_free(found, 'boom'):.0f} "
                f"and {stop_free(found, 'bucket'):.0f} mm after {CYCLES}. The balance sensor drifts by "
                f"{abs(drift['balance']['boom']['none']):.3f} and {abs(drift['balance']['bucket']['none']):.3f} mm "
                "per cycle.",
                Verdict.of(min(drift["table"][unit]["none"] for unit in found) > 1.0),
            ),
            Statement(
                "Abstract, discussion",
                "Simple proximity sensors at the cylinder's end or middle resolve the accumulation.",
                "With one switch the drift is gone (below 0.05 mm per cycle); a visit leaves at most "
                f"{kept['boom']:.1f} mm (boom) and {kept['bucket']:.1f} mm (bucket), less than the switch's own "
                "accuracy. Between visits the table's error of the cycle comes back each time.",
                Verdict.of(holds and bounded),
            ),
        ),
        (
            Picture(
                "fig17_drift",
                f"Error after each of {CYCLES} cycles without any reference, table and balance sensor.",
                lambda figure: _draw_drift(figure, {u: r for u, (r, _) in found.items()}),
                (7.2, 3.6),
            ),
            Picture(
                "fig18_references",
                "Error after each cycle with proximity switches and with the end stop found in the torque. Thin "
                "grey: the same without any reference.",
                lambda figure: _draw_references(figure, {u: r for u, (r, _) in found.items()}),
                (7.2, 5.0),
            ),
        ),
        (
            Grid(
                "Drift per cycle, error after 50 cycles and largest error at any time [mm]",
                ("unit and reference", "table: drift", "after 50", "largest", "balance: drift", "after 50", "largest"),
                rows,
            ),
        ),
    )


def stop_free(found: dict[str, tuple[dict[str, dict[str, Repeated]], float]], unit: str) -> float:
    """Error of the table after all cycles without a reference [mm]."""
    return float(found[unit][0]["table"]["none"].after_cycle[-1])


def _draw_drift(figure: Any, found: dict[str, dict[str, dict[str, Repeated]]]) -> None:
    axes = figure.add_subplot()
    for unit, style in (("boom", "-"), ("bucket", "--")):
        for sensor, colour in (("table", ESTIMATE), ("balance", BALANCE)):
            error = found[unit][sensor]["none"].after_cycle
            axes.plot(np.arange(1, len(error) + 1), error, style, color=colour, label=f"{sensor}, {unit}")
    axes.set(xlabel="cycle", ylabel="error after the cycle [mm]", yscale="log", xlim=(1, CYCLES))
    axes.legend(ncols=2, loc="lower right")


def _draw_references(figure: Any, found: dict[str, dict[str, dict[str, Repeated]]]) -> None:
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    styles = {"end": ("-", 1.6), "middle": ("--", 1.2), "both_ends": (":", 2.4), "stop": ("-.", 1.0)}
    for row, unit in zip(grid, found, strict=True):
        for axes, (sensor, colour) in zip(row, (("table", ESTIMATE), ("balance", BALANCE)), strict=True):
            number = np.arange(1, CYCLES + 1)
            axes.plot(number, found[unit][sensor]["none"].after_cycle, color=GREY, lw=0.8)
            for kind, (style, width) in styles.items():
                error = found[unit][sensor][kind].after_cycle
                axes.plot(number, error, style, color=colour, lw=width)
            top = max(r.after_cycle.max() for s in found[unit].values() for k, r in s.items() if k != "none")
            axes.set(title=f"{unit}, {sensor}", ylim=(0, 1.15 * top), xlim=(1, CYCLES))
        row[0].set_ylabel("error after\nthe cycle [mm]")
    for axes in grid[-1]:
        axes.set_xlabel("cycle")
    names = [grid[0, 0].plot([], [], color=GREY, lw=0.8)[0]]
    names += [grid[0, 0].plot([], [], style, color="0.25", lw=width)[0] for style, width in styles.values()]
    figure.legend(names, [NAMES["none"], *(NAMES[kind] for kind in styles)], ncols=3, loc="outside lower center")
