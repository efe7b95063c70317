"""How good a track is: errors after some visits to a stop, whether the band holds, and how often it is wrong and ok."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import BOUND
from ramsight.signals import Samples
from ramsight.tracking.track_errors import stop_visits

_WRONG, _LEAST = 4.0, 1e-3  # standard deviations and m from which a position that is reported as ok is wrong
_STANDING = 0.2  # rad/s; two steps of a drive that reports whole rpm
_STARTS = 0.5  # s after the motor has started, from when on an error counts
_APART = 5.0  # s between two visits to a stop
_SETTLES = 3.0  # s after a visit, from when on errors count
_AT_STOP = 1e-6  # m


@dataclass(frozen=True)
class Judged:
    """Figures of a track."""

    # median, p95, largest: of the errors while the motor turns, after the visits [m]; NaN if there were too few
    median: float
    p95: float
    largest: float
    # ok_p95, ok_largest: of those said to be ok [m]; 0 if there are none
    ok_p95: float
    ok_largest: float
    coverage: float  # share of the known samples off the stops whose error is within the 95 % band [1]
    wrong_and_ok: float  # share of all samples that are ok and more than four standard deviations and 1 mm off [1]
    ok: float  # share of all samples that are ok [1]
    std: float  # median standard deviation while the motor turns [m]
    beyond_bound: float  # share of the samples with a position whose error is beyond its bound [1]


def judge(
    track: Samples,
    motor_speed: NDArray[np.float64],
    position: NDArray[np.float64],
    stroke: float,
    *,
    after: int = 3,
) -> Judged:
    """Judge a track against the truth.

    Args:
        track: with position, position_std, position_bound and status over time; NaN where no position is known.
        motor_speed: at the same times [rad/s].
        position: the true one at the same times [m].
        stroke: of the cylinder [m].
        after: how many visits to a stop come first; 0 judges everything.
    """
    time, status = track["time"].values, track["status"].values
    error, std = np.abs(track["position"].values - position), track["position_std"].values
    turns = turning_for(time, motor_speed) > _STARTS
    begins = _after(stop_visits(time, position, stroke, tolerance=_AT_STOP), after) if after else float(time[0])
    known = np.isfinite(error)
    counts = turns & known & (time >= begins)
    ok = status == Status.OK
    off = known & (position > _AT_STOP) & (position < stroke - _AT_STOP)
    of = error[counts] if counts.any() else np.array([np.nan])
    said = error[counts & ok] if (counts & ok).any() else np.zeros(1)
    return Judged(
        median=float(np.median(of)),
        p95=float(np.percentile(of, 95.0)),
        largest=float(of.max()),
        ok_p95=float(np.percentile(said, 95.0)),
        ok_largest=float(said.max()),
        coverage=_share((error <= TWO_SIDED_95 * std)[off]),
        wrong_and_ok=float(wrong_and_ok(error, std, status).mean()),
        ok=float(ok.mean()),
        std=float(np.median(std[turns & known])) if (turns & known).any() else float("nan"),
        beyond_bound=_share((error > track[BOUND].values)[known]),
    )


def _share(which: NDArray[np.bool_]) -> float:
    """Of samples for which something holds; NaN if there are none."""
    return float(which.mean()) if which.size else float("nan")


def turning_for(time: NDArray[np.float64], motor_speed: NDArray[np.float64]) -> NDArray[np.float64]:
    """How long the motor has been turning at each sample [s], 0 while it stands.

    Args:
        time: [s], shape (n,), increasing.
        motor_speed: [rad/s], shape (n,).

    Example:
        >>> turning_for(np.arange(4.0), np.array([0.0, 5.0, 5.0, 0.0])).tolist()
        [0.0, 0.0, 1.0, 0.0]
    """
    turns = np.abs(motor_speed) > _STANDING
    starts = turns & ~np.concatenate([[False], turns[:-1]])
    since = np.maximum.accumulate(np.where(starts, np.arange(len(time)), 0))
    return np.where(turns, time - time[since], 0.0)


def wrong_and_ok(
    error: NDArray[np.float64], std: NDArray[np.float64], status: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Where a position is reported as ok and is more than four standard deviations and 1 mm off.

    Args:
        error: magnitudes [m].
        std: standard deviations that the sensor reports [m].
        status: numbers of `Status`.
    """
    return np.asarray((status == Status.OK) & (error > _WRONG * std) & (error > _LEAST))


def _after(visits: NDArray[np.float64], count: int) -> float:
    """When the visits that come first are over [s]; infinite if there are not so many."""
    kept: list[float] = []
    for visit in visits.tolist():
        if not kept or visit - kept[-1] > _APART:
            kept.append(visit)
    return kept[count - 1] + _SETTLES if len(kept) >= count else float("inf")
