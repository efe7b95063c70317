"""Loads that the table cannot follow: one that changes while the motor rests, and one near the relief pressure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ramsight.duty.lift_lower import RAMP, SPEED, lift_lower
from ramsight.duty.profile import Duty, Profile, constant, trapezoid_moves
from ramsight.duty.simulate import simulate
from ramsight.plant.steady import derive
from ramsight.sensor.status import Status
from ramsight.study.paper.bench import TEMPERATURE, Bench, Tracked
from ramsight.study.paper.drawing import BALANCE, ESTIMATE, TRUTH, UNITS, shade
from ramsight.study.paper.parts import Chapter, Picture, Statement, Verdict

SHARES = (0.80, 0.85, 0.90, 0.93, 0.96, 0.98, 0.99, 1.0, 1.01, 1.02, 1.04)
_HOLD, _BEFORE, _REST = 2.0, 1.0, 6.0  # s
_TAKES, _BACK = 0.3, 2.0  # s: in what time the load changes, and how long after the first move
_WRONG_MM = {"boom": 5.0, "bucket": 10.0}  # what the paper has at its high load; more has to be flagged


@dataclass(frozen=True)
class _AtRest:
    """A load put on and taken off while the motor rests."""

    tracks: dict[str, Tracked]
    change: tuple[float, float]
    moved_mm: float
    unseen_mm: dict[str, float]


def load_change(benches: dict[str, Bench]) -> Chapter:
    """A load change at rest."""
    found = {unit: _change_load(bench) for unit, bench in benches.items()}
    moved = {unit: run.moved_mm for unit, run in found.items()}
    unseen = {unit: run.unseen_mm for unit, run in found.items()}
    return Chapter(
        "A load change at rest",
        (
            "After a first move with its light load, each unit is given its high load while the motor stands still. "
            f"The oil is compressed: the rod gives way by {moved['boom']:.1f} mm (boom) and {moved['bucket']:.1f} mm "
            "(bucket) with no turn of the motor. No sensor that knows the motor alone can see that before the motor "
            f"turns again. The table never sees it: its error after the next move is {unseen['boom']['table']:.1f} "
            f"and {unseen['bucket']['table']:.1f} mm. The balance sensor finds the new pressure as soon as the "
            f"safety valve passes oil, and is back within {unseen['boom']['balance']:.1f} and "
            f"{unseen['bucket']['balance']:.1f} mm.",
        ),
        {"load_change_moves_rod_mm": moved, "load_change_error_mm": unseen},
        pictures=(
            Picture(
                "fig23_load_change",
                "Position and error of the boom when its load goes from light to high while the motor rests "
                "(shaded), before the second move.",
                lambda figure: _draw_change(figure, found["boom"]),
                (7.2, 4.2),
            ),
        ),
    )


def near_relief(benches: dict[str, Bench]) -> Chapter:
    """Loads near and above what the relief valve allows."""
    errors: dict[str, dict[str, dict[float, float]]] = {}
    unflagged: dict[str, dict[str, dict[float, float]]] = {}
    for unit, bench in benches.items():
        errors[unit] = {name: {} for name in bench.sensors}
        unflagged[unit] = {name: {} for name in bench.sensors}
        limit = derive(bench.unit).load_at_relief
        for share in SHARES:
            run = simulate(bench.unit, lift_lower(bench.unit, share * limit, TEMPERATURE, start_position=bench.at(0.5)))
            for name, sensor in bench.sensors.items():
                tracked = bench.track(run, sensor)
                sure = tracked.status == Status.OK
                errors[unit][name][share] = tracked.largest_mm
                unflagged[unit][name][share] = float(1e3 * np.abs(tracked.error[sure]).max()) if sure.any() else 0.0
    worst = {unit: max(by["table"].values()) for unit, by in errors.items()}
    silent = {unit: max(max(by.values()) for by in sensors.values()) for unit, sensors in unflagged.items()}
    return Chapter(
        "Near the relief pressure",
        (
            "Above about 97 % of the load that the relief valve holds, part of the pump's flow goes to the tank and "
            f"the calculated movement has nothing to do with the true one: up to {worst['boom']:.0f} mm (boom) and "
            f"{worst['bucket']:.0f} mm (bucket) for the table, in one cycle. The sensors say so: from 97 % of the "
            "opening pressure or torque on they call themselves uncertain, and once the valve has passed oil they "
            "call the position lost until a reference comes. The largest error of any sample that was called ok is "
            f"{silent['boom']:.1f} mm (boom) and {silent['bucket']:.1f} mm (bucket).",
        ),
        {
            "near_relief_error_mm": {u: {s: _named(by) for s, by in sensors.items()} for u, sensors in errors.items()},
            "near_relief_error_called_ok_mm": {
                u: {s: _named(by) for s, by in sensors.items()} for u, sensors in unflagged.items()
            },
            "largest_error_called_ok_near_relief_mm": silent,
        },
        (
            Statement(
                "Section 2, conclusion",
                "Near and over the maximum pressure the position calculation is no longer valid.",
                f"The table errs by up to {worst['boom']:.0f} mm (boom) and {worst['bucket']:.0f} mm (bucket); every "
                "sample worse than the paper's error at high load carries a status that says so.",
                Verdict.of(all(worst[u] > 10 * w and silent[u] <= 1.3 * w for u, w in _WRONG_MM.items())),
            ),
        ),
        (
            Picture(
                "fig24_relief",
                "Largest error of one cycle over the load, as a share of the load at the relief pressure: of all "
                "samples, and of those that the sensor called ok.",
                lambda figure: _draw_relief(figure, errors, unflagged),
                (7.2, 3.6),
            ),
        ),
    )


def _change_load(bench: Bench) -> _AtRest:
    """Light load, a move, rest; high load put on; another move."""
    up = SPEED * bench.unit.lift_sign
    hold = min(_HOLD, 0.2 * bench.unit.cylinder.stroke / (SPEED * bench.unit.travel_per_radian))
    speed = trapezoid_moves([(up, hold), (-up, hold)], ramp=RAMP, before=_BEFORE, rest=_REST)
    begin = _BEFORE + hold + 2 * RAMP + _BACK
    light, high = bench.loads["light"], bench.loads["high"]
    load = Profile([0.0, begin, begin + _TAKES], [light, light, high])
    run = simulate(bench.unit, Duty(speed, load, constant(TEMPERATURE), bench.at(0.4)))
    before, after = (float(np.interp(t, run["time"], run["position"])) for t in (begin, begin + _TAKES + 1.0))
    tracks = {name: bench.track(run, sensor) for name, sensor in bench.sensors.items()}
    unseen = {name: tracked.final_mm for name, tracked in tracks.items()}
    return _AtRest(tracks, (begin, begin + _TAKES), 1e3 * abs(after - before), unseen)


def _named(by: dict[float, float]) -> dict[str, float]:
    return {f"{100 * share:.0f}_percent": value for share, value in by.items()}


def _draw_change(figure: Any, run: _AtRest) -> None:
    position, error = figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
    table, balance = run.tracks["table"], run.tracks["balance"]
    position.plot(table.time, 1e3 * table.truth, color=TRUTH, lw=2.4, label="actual")
    position.plot(table.time, 1e3 * table.estimate, color=ESTIMATE, lw=1.2, label="table")
    position.plot(table.time, 1e3 * balance.estimate, color=BALANCE, lw=1.2, ls="--", label="balance")
    position.set_ylabel("position [mm]")
    error.plot(table.time, 1e3 * table.error, color=ESTIMATE, lw=1.2)
    error.plot(table.time, 1e3 * balance.error, color=BALANCE, lw=1.2, ls="--")
    error.axhline(0.0, color=TRUTH, lw=0.6)
    error.set(xlabel="time [s]", ylabel="error [mm]", xlim=(0, table.time[-1]))
    for axes in (position, error):
        shade(axes, [run.change], "load changes")
    position.legend()
    figure.align_ylabels()


def _draw_relief(
    figure: Any,
    errors: dict[str, dict[str, dict[float, float]]],
    unflagged: dict[str, dict[str, dict[float, float]]],
) -> None:
    panels = figure.subplots(1, 2, sharey=True)
    for axes, unit in zip(panels, errors, strict=True):
        for sensor, colour in (("table", ESTIMATE), ("balance", BALANCE)):
            style, _ = UNITS["boom"]
            share = 100 * np.array(list(errors[unit][sensor]))
            axes.plot(share, list(errors[unit][sensor].values()), style, color=colour, label=f"{sensor}, all samples")
            called = np.array(list(unflagged[unit][sensor].values()))
            axes.plot(share, np.maximum(called, 1e-2), "o:", color=colour, lw=1.0, label=f"{sensor}, called ok")
        axes.set(xlabel="load [% of that at relief]", title=unit, yscale="log")
    panels[0].set_ylabel("largest error [mm]")
    panels[0].legend(fontsize=8)
