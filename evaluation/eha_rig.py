"""ramsight on a real actuator: identified on the runs of one day, judged on those of others.

    python evaluation/eha_rig.py --fit NAME=FOLDER --judge NAME=FOLDER [NAME=FOLDER ...] --out FILE.json

The runs are those of a laboratory actuator (public repository ivliev123/Electro-Hydraulic-Actuator), a file each, with
the columns that `rig.toml` names. From the runs in the first folder the values of `eha-valve-rig` are found as
`ramsight identify` finds them; every run in the other folders is tracked with them from its first position, from the
shaft's angle, the motor's current and the valve's command alone, and once more with the chambers' pressures. The rig's
position sensor has a curve of its own, which is identified with the rest; the track is given in that sensor's readings
and held against what it read (`all`, `runs`), and, for comparison, as it is (`all_without_curve`). The file is a table:
what was identified on NAME, judged on each NAME; further calls with other names add to it.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

import ramsight
from ramsight.calibration.fit_track import FittedValues, MeasuredRun
from ramsight.calibration.identify_report import motor_with
from ramsight.logs import read_log
from ramsight.logs.channel_map import load_map
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.opening import read_measured
from ramsight.normal import TWO_SIDED_95
from ramsight.output import write_text
from ramsight.progress import progress
from ramsight.sensor.inputs.sample import PRESSURES
from ramsight.sensor.status import Status
from ramsight.tracking.credible import credible_run

HERE = Path(__file__).parent
MAP = HERE / "rig.toml"
MACHINE, UNIT = "eha-valve-rig", "axis"
SIGNALS = {"angle_current": False, "angle_current_pressure": True}
START_STD = "0.1 mm"
_STILL = 0.5e-3  # m/s; slower, the piston stands
_RESTS, _MOVES = 0.5, 2e-3  # s and m; shorter rests and moves are none


def main() -> None:
    """Fit, judge, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", type=named, required=True, help="NAME=FOLDER with the runs to identify from")
    parser.add_argument("--judge", type=named, required=True, nargs="+", help="NAME=FOLDER with runs to judge")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument(
        "--figures", type=named, default=[], nargs="+", help="NAME=FILE.png for figures of those judged"
    )
    given = parser.parse_args()
    known = load_map(MAP)
    fit_name, fit_folder = given.fit
    found = ramsight.identify_values(MACHINE, runs_in(fit_folder, known), unit=UNIT, progress=True)
    tuned = with_found(known, found)
    result = {"date": date.today().isoformat(), "machine": MACHINE, "fit": described(found, tuned), "judged": {}}
    for name, folder in given.judge:
        result["judged"][name], drawn = judged(found, runs_in(folder, tuned), tuned, name)
        for file in (file for figure, file in given.figures if figure == name):
            from eha_rig_figure import draw

            draw(drawn, file)
    table = json.loads(given.out.read_text(encoding="utf-8")) if given.out.exists() else {}
    write_text(json.dumps(table | {fit_name: result}, indent=1) + "\n", given.out)
    print(json.dumps({name: one["all"] for name, one in result["judged"].items()}, indent=1))


def named(text: str) -> tuple[str, Path]:
    """A folder with its name: ``NAME=FOLDER``, or the folder's own."""
    name, equals, folder = text.rpartition("=")
    return (name if equals else Path(folder).name), Path(folder)


def judged(
    found: FittedValues, recorded: list[MeasuredRun], tuned: ChannelMap, title: str
) -> tuple[dict[str, Any], list[tuple[MeasuredRun, Any]]]:
    """Figures of tracks along runs, for each set of signals; the runs and the tracks of the first set for a figure."""
    result: dict[str, Any] = {"runs": {}, "all": {}, "all_without_curve": {}}
    drawn: list[tuple[MeasuredRun, Any]] = []
    for name, pressures in SIGNALS.items():
        given = [given_pressures(run, pressures) for run in recorded]
        with progress(len(given), f"judging {title}, {name.replace('_', ' ')}") as bar:
            tracks = [(tracked(found, run, bar.advance), run) for run in given]
        read = [as_read(track, run, tuned) for track, run in tracks]
        drawn = drawn or [(run, track) for track, run in read]
        rows = {run.name: errors(track, run) for track, run in read}
        plain = [errors(track, unbent(run, tuned)) for track, run in tracks]
        result["all"][name], result["all_without_curve"][name] = overall(list(rows.values())), overall(plain)
        for run_name, row in rows.items():
            result["runs"].setdefault(run_name, {})[name] = row
    return result, drawn


def given_pressures(run: MeasuredRun, pressures: bool) -> MeasuredRun:
    """The run as the sensor is given it: with the chambers' pressures in its log, or without."""
    if not pressures:
        return run
    return replace(run, log=run.log.assign({name: run.measured[name] for name in PRESSURES if name in run.measured}))


def described(fitted: FittedValues, tuned: ChannelMap) -> dict[str, Any]:
    """What was identified."""
    values = {
        key: {"value": value, "low": low, "high": high, "told": key in fitted.identified}
        for key, (value, low, high) in fitted.values.items()
    }
    motor = tuned.motor
    return {
        "runs": sorted(fitted.rms_of),
        "rms_mm": fitted.rms * 1e3,
        "values": values,
        "torque_constant": None if motor is None else motor.torque_constant,
        "saturation": None if motor is None else motor.saturation,
    }


def runs_in(folder: Path, known: ChannelMap) -> list[MeasuredRun]:
    """All runs of a folder."""
    files = sorted(file for file in folder.iterdir() if file.name.endswith((".csv", ".csv.gz")))
    if not files:
        raise SystemExit(f"{folder}: there are no runs")
    return [run_of(file, known) for file in files]


def run_of(file: Path, known: ChannelMap) -> MeasuredRun:
    """A run, without what of its position and pressures the rig cannot have."""
    log, measured = read_log(file, known), read_measured(file, known)
    unit = ramsight.build(MACHINE, unit=UNIT)
    return MeasuredRun(file.name, log, credible_run(log, measured, unit, file.name), known.linearity)


def with_found(known: ChannelMap, fitted: FittedValues) -> ChannelMap:
    """The map with the torque of the current and the curve of the position's sensor that were found."""
    motor = None if known.motor is None else motor_with(known.motor, fitted.torque)
    return replace(known, motor=motor, curve=fitted.curve)


def unbent(run: MeasuredRun, tuned: ChannelMap) -> MeasuredRun:
    """The run with the position as it was read, with no curve."""
    if tuned.curve is None:
        return run
    return replace(run, measured=run.measured.assign(position=("time", tuned.curve.reading(run.measured["position"]))))


def as_read(track: Any, run: MeasuredRun, tuned: ChannelMap) -> tuple[Any, MeasuredRun]:
    """What the rig's own sensor would read where the track is, and what it did read."""
    if tuned.curve is None:
        return track, run
    return track.assign(position=("time", tuned.curve.reading(track["position"]))), unbent(run, tuned)


def tracked(fitted: FittedValues, run: MeasuredRun, advance: Any) -> Any:
    """The run as the sensor tracks it from its first position."""
    track = ramsight.track(fitted.machine, run.log, unit=UNIT, sensor="kalman", start=run.start, start_std=START_STD)
    advance()
    return track


def errors(track: Any, run: MeasuredRun) -> dict[str, Any]:
    """Figures of a track against the measured position."""
    true = run.measured["position"].values
    good = np.isfinite(true)
    error = (track["position"].values - true)[good]
    std, status = track["position_std"].values[good], track["status"].values[good]
    time = run.log["time"].values
    ends = [float((track["position"].values - true)[k] * 1e3) for k in ends_of_moves(time, true)]
    wrong = (np.abs(error) > 4.0 * std) & (status < Status.NOT_REFERENCED)
    return {
        "ends_mm": ends,
        "largest_end_mm": max((abs(end) for end in ends), default=None),
        "largest_mm": float(np.abs(error).max() * 1e3),
        "rms_mm": float(np.sqrt(np.mean(error**2)) * 1e3),
        "coverage_95": float(np.mean(np.abs(error) < TWO_SIDED_95 * std)),
        "median_std_mm": float(np.median(std) * 1e3),
        "ok_beyond_4_std_longest_s": longest(wrong, float(np.median(np.diff(time)))),
        "samples": int(good.sum()),
    }


def ends_of_moves(time: Any, true: Any) -> list[int]:
    """Samples at which the piston has come to rest after a move."""
    filled = np.interp(time, time[np.isfinite(true)], true[np.isfinite(true)])
    period = float(np.median(np.diff(time)))
    wide = max(round(0.1 / period), 1)
    speed = np.abs(filled[wide:] - filled[:-wide]) / (wide * period)
    still = np.concatenate([speed < _STILL, np.ones(wide, dtype=bool)])
    ends, rest, place = [], 0, filled[0]
    needed = round(_RESTS / period)
    for k, stands in enumerate(still):
        rest = rest + 1 if stands else 0
        if rest == needed and abs(filled[k] - place) > _MOVES:
            place = filled[k]
            if np.isfinite(true[k]):
                ends.append(k)
    return ends


def longest(condition: Any, period: float) -> float:
    """The longest stretch for which a condition holds [s]."""
    best = run = 0
    for holds in condition:
        run = run + 1 if holds else 0
        best = max(best, run)
    return best * period


def overall(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The same figures over all runs."""
    samples = np.array([row["samples"] for row in rows], dtype=float)
    ends = np.abs(np.concatenate([row["ends_mm"] for row in rows]))
    return {
        "largest_end_mm": float(ends.max()),
        "p95_end_mm": float(np.quantile(ends, 0.95)),
        "largest_mm": max(row["largest_mm"] for row in rows),
        "rms_mm": float(np.sqrt(np.average([row["rms_mm"] ** 2 for row in rows], weights=samples))),
        "largest_rms_mm": max(row["rms_mm"] for row in rows),
        "coverage_95": float(np.average([row["coverage_95"] for row in rows], weights=samples)),
        "least_coverage_95": min(row["coverage_95"] for row in rows),
        "ok_beyond_4_std_longest_s": max(row["ok_beyond_4_std_longest_s"] for row in rows),
        "moves": len(ends),
        "samples": int(samples.sum()),
    }


if __name__ == "__main__":
    main()
