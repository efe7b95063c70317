"""Whether the sensor is right again once a fault's cause is gone and the piston has met three end stops.

Faults of motor speed and torque are put early into work days of machines drawn at random, so that three visits to an
end stop come after them. From shortly after the third one until the day's end the errors are compared with those of the
same day without the fault: it is over if 95 % of them are no larger than those by more than 2 mm, and the sensor does
not say any more that the drive's report contradicts itself or did.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from typing import Any

import faults
import numpy as np
import work_days
from judged_errors import wrong_and_ok
from numpy.typing import NDArray

from ramsight.duty.faults import Fault
from ramsight.sensor.report.detectors import CONTRADICTIONS
from ramsight.sensor.status import Status
from ramsight.tracking.track_errors import stop_visits

SIGNALS = ("speed, torque, temperature", "+ counter and DC power")
"""What the sensor is given, of `faults.SIGNALS`."""
CHANNELS = ("motor_speed", "motor_torque")
_REFERENCES = 3
_EARLIEST, _LATEST = 100.0, 170.0  # s
_SETTLES = 4.0  # s after the third visit
_LEAST = 50  # samples that a day has to have after it, to be judged
_WORSE = 2e-3  # m
_SAYS = 0.05  # share of the samples that may still speak of the fault


def study(machines: int, advance: Callable[[int], object]) -> dict[str, list[dict[str, Any]]]:
    """By what the sensor is given, a row a fault.

    Args:
        machines: of boom and bucket together.
        advance: told of each that is done.
    """
    return {name: _given(faults.SIGNALS[name], machines, advance) for name in SIGNALS}


def _given(keys: dict[str, float], machines: int, advance: Callable[[int], object]) -> list[dict[str, Any]]:
    found: dict[tuple[str, str], list[tuple[bool, float, float]]] = defaultdict(list)
    for sensor, day, seed in work_days.days(machines, keys, advance):
        visits = stop_visits(day.log["time"].values, day.position, day.unit.cylinder.stroke)
        (clean,) = faults.tracks_of(sensor, [day], [day.log])
        at = np.random.default_rng(seed).choice(faults.turning(day.log, _EARLIEST, _LATEST))
        injected = [one for one in faults.faults(float(at), day.log) if one[0] in CHANNELS]
        logs = [faults.with_rows(day, fault, seed) for _, _, fault in injected]
        tracks = faults.tracks_of(sensor, [day] * len(logs), [log for log, _ in logs])
        for (channel, words, fault), (_, rows), track in zip(injected, logs, tracks, strict=True):
            judged = after(day, clean, track, rows, fault, visits)
            if judged is not None:
                found[channel, words].append(judged)
    return [_row(*key, results) for key, results in found.items()]


def after(
    day: work_days.Day,
    clean: faults.Track,
    track: faults.Track,
    rows: NDArray[np.int64],
    fault: Fault,
    visits: NDArray[np.float64],
) -> tuple[bool, float, float] | None:
    """Whether a fault is over after three references, by how much the error is larger [m], share wrong and ok [1].

    None where the day ends too early to say.
    """
    time, later = day.log["time"].values[rows], visits[visits > fault.end]
    if len(later) < _REFERENCES:
        return None
    judged = time > later[_REFERENCES - 1] + _SETTLES
    if judged.sum() < _LEAST:
        return None
    truth = day.position[rows]
    error, usual = (np.abs(one - truth)[judged] for one in (track["position"], clean["position"][rows]))
    status, std = track["status"][judged], track["position_std"][judged]
    worse = float(np.percentile(error, 95) - np.percentile(usual, 95))
    says = float(np.isin(status, [*CONTRADICTIONS, Status.FAULT_PASSED]).mean())
    return worse <= _WORSE and says <= _SAYS, worse, float(wrong_and_ok(error, std, status).mean())


def _row(channel: str, words: str, results: list[tuple[bool, float, float]]) -> dict[str, Any]:
    over, worse, wrong = (np.array(column, dtype=float) for column in zip(*results, strict=True))
    return {
        "input": channel,
        "fault": words,
        "judged": len(results),
        "over": int(over.sum()),
        "worse_worst_mm": 1e3 * float(worse.max()),
        "wrong_and_ok": float(wrong.mean()),
    }


def table(found: dict[str, list[dict[str, Any]]]) -> list[str]:
    """The table of docs/reference/fault-detection.md: a fault a row, by what the sensor is given."""
    names = list(found)
    rows = [f"| fault | {' | '.join(names)} |", "|---" * (len(names) + 1) + "|"]
    for both in zip(*(found[name] for name in names), strict=True):
        fault = f"{both[0]['input'].replace('_', ' ')}, {both[0]['fault']}"
        cells = [f"{row['over']} of {row['judged']}, {max(row['worse_worst_mm'], 0.0):.1f} mm" for row in both]
        rows.append(f"| {fault} | {' | '.join(cells)} |")
    return rows
