"""Loads that change while the motor rests: put on, taken off, and a bucket that empties between two moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ramsight import Duty, Profile, simulate
from ramsight.duty.lift_lower import SPEED
from ramsight.duty.profile import constant, trapezoid_moves
from ramsight.plant.steady import torque_at_load
from reproduction.bench import TEMPERATURE, Bench, Tracked
from reproduction.chapter import Chapter, Grid, Picture, Statement, Verdict
from reproduction.figure_style import SENSORS, TRUTH, shade
from reproduction.words import both, figure

_HOLD, _BEFORE, _REST = 2.0, 1.0, 6.0  # s
_TAKES, _BACK = 0.3, 2.0  # s: in what time the load changes, and how long after the first move
_CYCLES = 10  # of lifting, emptying, lowering and loading
_EMPTIES, _WAITS = 1.0, 3.0  # s: in what time a load comes or goes, and how long the motor rests for it


@dataclass(frozen=True)
class AtRest:
    """A load that changed while the motor rested.

    Attributes:
        tracks: what each sensor made of it.
        change: when it began and ended [s].
        moved_mm: how far the rod went by it.
        unseen_mm: error of each sensor after the next move.
    """

    tracks: dict[str, Tracked]
    change: tuple[float, float]
    moved_mm: float
    unseen_mm: dict[str, float]


def load_change(benches: dict[str, Bench]) -> Chapter:
    """Chapter on loads that change at rest."""
    put_on = {unit: _change_load(bench, "light", "high") for unit, bench in benches.items()}
    taken_off = {unit: _change_load(bench, "high", "light") for unit, bench in benches.items()}
    emptied = {unit: _emptying(bench) for unit, bench in benches.items()}
    return Chapter(
        "A load change at rest, and a bucket that empties",
        _text(put_on, taken_off, emptied),
        {
            "load_change_moves_rod_mm": _moved(put_on),
            "load_change_error_mm": {unit: run.unseen_mm for unit, run in put_on.items()},
            "load_taken_off_moves_rod_mm": _moved(taken_off),
            "load_taken_off_error_mm": {unit: run.unseen_mm for unit, run in taken_off.items()},
            "emptying_cycles_error_mm": emptied,
        },
        (_dumping(taken_off, emptied),),
        (
            Picture(
                "fig23_load_change",
                "Position and error of the boom when its load goes from light to high while the motor rests "
                "(shaded), before the second move.",
                lambda figure: _draw_change(figure, put_on["boom"]),
                (7.2, 4.2),
            ),
        ),
        (_grid(emptied),),
    )


def _text(
    put_on: dict[str, AtRest], taken_off: dict[str, AtRest], emptied: dict[str, dict[str, dict[str, float]]]
) -> tuple[str, ...]:
    first = {unit: by["after_1"]["table"] for unit, by in emptied.items()}
    return (
        "After a first move with its light load, each unit is given its high load while the motor stands still. "
        f"The oil is compressed: the rod gives way by {both(_moved(put_on))} with no turn of the motor. No sensor that "
        "knows the motor alone can see that before the motor turns again. The table never sees it: its error after the "
        f"next move is {both(_unseen(put_on, 'table'))}. Balance and self-calibrating sensor find the new pressure as "
        f"soon as the safety valve passes oil: {both(_unseen(put_on, 'balance'))}, and "
        f"{both(_unseen(put_on, 'kalman'))}.",
        f"A load that is taken off, as when the bucket empties, moves the rod by {both(_moved(taken_off))} the other "
        "way. The paper's cycles lift and lower the same load; a loader lifts a full bucket and lowers an empty one. "
        f"In such cycles the table errs by {both(first)} after the first one. What the rod rises by when the load goes "
        f"it loses again when the load comes back; what {_CYCLES} such cycles leave is in the grid below.",
    )


def _moved(runs: dict[str, AtRest]) -> dict[str, float]:
    return {unit: run.moved_mm for unit, run in runs.items()}


def _unseen(runs: dict[str, AtRest], sensor: str) -> dict[str, float]:
    return {unit: run.unseen_mm[sensor] for unit, run in runs.items()}


def _dumping(taken_off: dict[str, AtRest], emptied: dict[str, dict[str, dict[str, float]]]) -> Statement:
    last = {unit: by[f"after_{_CYCLES}"] for unit, by in emptied.items()}
    return Statement(
        "Discussion",
        "A typical work cycle of a loader lifts a load and dumps it; references at ends or middle resolve the error.",
        f"Dumping itself moves the rod by {both(_moved(taken_off))} while the motor rests, which no table of movement "
        f"per revolution has. After {_CYCLES} such cycles without a reference: table "
        f"{both({u: e['table'] for u, e in last.items()})}, self-calibrating "
        f"{both({u: e['kalman'] for u, e in last.items()})}. A reference ends either.",
        Verdict.REPRODUCED,
    )


def _change_load(bench: Bench, first: str, second: str) -> AtRest:
    """One load, a move, rest; another load; another move."""
    up = SPEED * bench.unit.lift_sign
    hold = min(_HOLD, 0.2 * bench.unit.cylinder.stroke / (SPEED * bench.unit.travel_per_radian))
    speed = trapezoid_moves([(up, hold), (-up, hold)], ramp=bench.ramp, before=_BEFORE, rest=_REST)
    begin = _BEFORE + hold + 2 * bench.ramp + _BACK
    before, then = bench.loads[first], bench.loads[second]
    load = Profile([0.0, begin, begin + _TAKES], [before, before, then])
    run = simulate(bench.unit, Duty(speed, load, constant(TEMPERATURE), bench.at(0.4)))
    was, now = (float(np.interp(t, run["time"], run["position"])) for t in (begin, begin + _TAKES + 1.0))
    tracks = {name: bench.track(run, sensor) for name, sensor in bench.sensors.items()}
    unseen = {name: tracked.final_mm for name, tracked in tracks.items()}
    return AtRest(tracks, (begin, begin + _TAKES), 1e3 * abs(now - was), unseen)


def _emptying(bench: Bench) -> dict[str, dict[str, float]]:
    """Cycles that lift the high load and lower the light one: errors after the first and the last [mm], by sensor."""
    up = SPEED * bench.unit.lift_sign
    hold = 0.25 * bench.unit.cylinder.stroke / (SPEED * bench.unit.travel_per_radian)
    # Lowering goes faster per turn than lifting; it is shortened so that the rod comes back to about where it was.
    lifted, lowered = (torque_at_load(bench.unit, bench.loads[name], TEMPERATURE, SPEED) for name in ("high", "light"))
    back = (hold + bench.ramp) * lifted.travel_lift / lowered.travel_lower - bench.ramp
    speed = trapezoid_moves([(up, hold), (-up, back)], ramp=bench.ramp, before=_BEFORE, rest=_WAITS)
    at_top = _BEFORE + hold + 2 * bench.ramp + 1.0
    at_bottom = float(speed.time[-1]) - _WAITS + 1.0
    high, light = bench.loads["high"], bench.loads["light"]
    corners = [0.0, at_top, at_top + _EMPTIES, at_bottom, at_bottom + _EMPTIES]
    duty = Duty(speed, Profile(corners, [high, high, light, light, high]), constant(TEMPERATURE), bench.at(0.35))
    run = simulate(bench.unit, duty.repeated(_CYCLES))
    found: dict[str, dict[str, float]] = {"after_1": {}, f"after_{_CYCLES}": {}, "largest": {}}
    for name, sensor in bench.sensors.items():
        tracked = bench.track(run, sensor)
        error = 1e3 * np.abs(tracked.error)
        found["after_1"][name] = float(np.interp(duty.duration, tracked.time, error))
        found[f"after_{_CYCLES}"][name] = float(error[-1])
        found["largest"][name] = float(error.max())
    return found


def _grid(emptied: dict[str, dict[str, dict[str, float]]]) -> Grid:
    rows = tuple(
        (f"{unit}, {when.replace('_', ' ')}", *(figure(errors[sensor], 2) for sensor in SENSORS))
        for unit, by in emptied.items()
        for when, errors in by.items()
    )
    caption = f"Error of {_CYCLES} cycles that lift the high load, empty, lower the light one, and load again [mm]"
    return Grid(caption, ("unit, cycles", *(look.name for look in SENSORS.values())), rows)


def _draw_change(figure: Any, run: AtRest) -> None:
    position, error = figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
    time = run.tracks["table"].time
    position.plot(time, 1e3 * run.tracks["table"].truth, color=TRUTH, lw=2.4, label="actual")
    for name, look in SENSORS.items():
        track = run.tracks[name]
        position.plot(time, 1e3 * track.estimate, look.style, color=look.colour, lw=1.2, label=look.name)
        error.plot(time, 1e3 * track.error, look.style, color=look.colour, lw=1.2)
    position.set_ylabel("position [mm]")
    error.axhline(0.0, color=TRUTH, lw=0.6)
    error.set(xlabel="time [s]", ylabel="error [mm]", xlim=(0, time[-1]))
    for axes in (position, error):
        shade(axes, [run.change], "load changes")
    position.legend()
    figure.align_ylabels()
