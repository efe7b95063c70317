"""The error of an estimated position against the truth, and the figures of a track that follow from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ramsight.arrays import Array
from ramsight.errors import RamsightError
from ramsight.sensor.status import is_invalid
from ramsight.sensor.virtual_sensor import LIVE
from ramsight.signals import Dataset, Samples, Signal, Signals


class ComparisonError(RamsightError):
    """An estimate and a truth that cannot be compared."""


@dataclass(frozen=True)
class PositionErrors:
    """Absolute errors of an estimated position."""

    largest: float  # the largest error [m]
    p95: float  # the error that 95 % of the samples keep within [m]
    final: float  # the error of the last sample compared [m]; NaN if that sample has no estimate
    samples: int  # number of samples compared, those without an estimate not counted
    missing: int  # number of samples within the same time at which the estimate is NaN


@dataclass(frozen=True)
class TrackErrors:
    """Errors of a track, apart from what nobody should use of it."""

    # of the samples whose position is not said to be invalid; None if there are none with a position
    usable: PositionErrors | None
    invalid: int  # number of samples with a position that the sensor reports is invalid
    invalid_largest: float  # the largest error among those [m]; NaN if there are none
    set_back: int  # number of samples that are no later than one before them, at which the truth is not defined


def track_errors(
    time: ArrayLike, position: ArrayLike, invalid: ArrayLike, truth_time: ArrayLike, truth_position: ArrayLike
) -> TrackErrors:
    """Errors of a track as a drive's clock and a sensor make it.

    Args:
        time: times of the track [s], shape (n,); a clock may have been set back.
        position: estimated position [m], shape (n,), NaN where there is none.
        invalid: whether the sensor reports that its position is invalid, shape (n,).
        truth_time: times of the truth [s], shape (m,), increasing.
        truth_position: true position [m], shape (m,), finite.

    Raises:
        ComparisonError: the two have no time in common, or the truth is none.

    Example:
        >>> found = track_errors([0.0, 1.0, 0.5, 2.0], [0.1, 0.2, 0.2, 0.9], [0, 0, 0, 1], [0.0, 2.0], [0.1, 0.3])
        >>> found.usable.samples, found.invalid, round(found.invalid_largest, 3), found.set_back
        (2, 1, 0.6, 1)
    """
    times, positions = np.asarray(time, dtype=np.float64), np.asarray(position, dtype=np.float64)
    latest = np.maximum.accumulate(np.concatenate([[-np.inf], times[:-1]]))
    later = times > latest
    times, positions, bad = times[later], positions[later], np.asarray(invalid, dtype=bool)[later]
    common = (times >= np.min(truth_time)) & (times <= np.max(truth_time))
    nowhere = common.any() and np.isnan(positions[common & ~bad]).all()
    usable = None
    if not nowhere:
        usable = position_errors(times, np.where(bad, np.nan, positions), truth_time, truth_position)
    known = common & bad & ~np.isnan(positions)
    errors = np.abs(positions[known] - np.interp(times[known], np.asarray(truth_time), np.asarray(truth_position)))
    largest = float(errors.max()) if errors.size else float("nan")
    return TrackErrors(usable, int(errors.size), largest, int((~later).sum()))


def position_errors(
    estimate_time: ArrayLike,
    estimate_position: ArrayLike,
    truth_time: ArrayLike,
    truth_position: ArrayLike,
    *,
    until: float | None = None,
) -> PositionErrors:
    """Errors of an estimate at its own times, where the truth is known.

    The truth is interpolated linearly. Estimates before its first or after its last sample are left out; NaN
    estimates are counted, and take no part in ``largest`` and ``p95``.

    Args:
        estimate_time: times of the estimate [s], shape (n,), increasing.
        estimate_position: estimated position [m], shape (n,), NaN where there is none.
        truth_time: times of the truth [s], shape (m,), increasing.
        truth_position: true position [m], shape (m,), finite.
        until: compare up to this time [s] only, itself included.

    Returns:
        The largest, the 95 % and the final absolute error [m], and how many samples they rest on.

    Raises:
        ComparisonError: the two have no time in common, the truth has gaps, times do not increase, lengths
            differ, or every estimate within the common time is NaN.

    Example:
        >>> errors = position_errors([0.0, 0.5, 1.0], [0.1, 0.151, 0.2], [0.0, 1.0], [0.1, 0.2])
        >>> round(errors.largest, 6), round(errors.final, 6), errors.samples
        (0.001, 0.0, 3)
    """
    time, estimate = _series(estimate_time, estimate_position, "estimate")
    known_at, known = _series(truth_time, truth_position, "truth")
    if not np.isfinite(known).all():
        raise ComparisonError(f"the truth has no position at {known_at[~np.isfinite(known)][0]:g} s")
    end = known_at[-1] if until is None else min(float(until), known_at[-1])
    common = (time >= known_at[0]) & (time <= end)
    if not common.any():
        limit = "" if until is None else f", up to {until:g} s"
        raise ComparisonError(
            f"the estimate ({time[0]:g} to {time[-1]:g} s) and the truth ({known_at[0]:g} to"
            f" {known_at[-1]:g} s{limit}) have no time in common"
        )
    error = np.abs(estimate[common] - np.interp(time[common], known_at, known))
    present = error[~np.isnan(error)]
    if not present.size:
        raise ComparisonError(f"none of the {error.size} samples has an estimated position")
    return PositionErrors(
        largest=float(present.max()),
        p95=float(np.percentile(present, 95.0)),
        final=float(error[-1]),
        samples=int(present.size),
        missing=int(error.size - present.size),
    )


def first_stop_contact(
    truth_time: ArrayLike, truth_position: ArrayLike, stroke: float, *, tolerance: float = 1e-4
) -> float | None:
    """When the piston first touches an end stop, after which an estimate is no longer dead reckoning alone.

    Args:
        truth_time: times [s], shape (n,), increasing.
        truth_position: true position [m], shape (n,).
        stroke: stroke of the cylinder [m].
        tolerance: how near to a stop counts as touching it [m].

    Returns:
        Time of the first sample within ``tolerance`` of either stop [s], or None if there is none.

    Raises:
        ComparisonError: lengths differ, times do not increase, or the series is empty.

    Example:
        >>> first_stop_contact([0.0, 1.0, 2.0], [0.2, 0.1, 0.0], 0.79)
        2.0
        >>> first_stop_contact([0.0, 1.0], [0.2, 0.3], 0.79) is None
        True
    """
    time, position = _series(truth_time, truth_position, "truth")
    touching = (position <= tolerance) | (position >= stroke - tolerance)
    return float(time[np.argmax(touching)]) if touching.any() else None


def stop_visits(truth_time: ArrayLike, truth_position: ArrayLike, stroke: float, *, tolerance: float = 2e-3) -> Array:
    """When the piston came to an end stop [s], shape (visits,).

    Args:
        truth_time: times [s], shape (n,), increasing.
        truth_position: true position [m], shape (n,).
        stroke: stroke of the cylinder [m].
        tolerance: how near to a stop counts as being there [m]; stops give way a little.

    Raises:
        ComparisonError: lengths differ, times do not increase, or the series is empty.

    Example:
        >>> stop_visits([0.0, 1.0, 2.0, 3.0], [0.1, 0.0, 0.1, 0.5], 0.5).tolist()
        [1.0, 3.0]
    """
    time, position = _series(truth_time, truth_position, "truth")
    there = (position < tolerance) | (position > stroke - tolerance)
    comes = there & ~np.concatenate([[False], there[:-1]])
    return np.asarray(time[comes])


def _series(time: ArrayLike, position: ArrayLike, whose: str) -> tuple[Array, Array]:
    times, positions = np.asarray(time, dtype=np.float64), np.asarray(position, dtype=np.float64)
    if times.ndim != 1 or times.shape != positions.shape:
        raise ComparisonError(f"the {whose}'s times {times.shape} and positions {positions.shape} do not match")
    if not times.size:
        raise ComparisonError(f"the {whose} has no samples")
    if not (times[1:] > times[:-1]).all() or not np.isfinite(times).all():
        raise ComparisonError(f"the {whose}'s times do not increase")
    return times, positions


def judged(tracked: Dataset, truth: Samples) -> Dataset:
    """A track with the true position and the error beside it, and their figures among its attributes.

    Args:
        tracked: with `position` [m] and `status` over `time` [s].
        truth: with `position` [m] over `time` [s], increasing.

    Raises:
        ComparisonError: the two have no time in common.
    """
    found = errors_of(tracked, truth)
    beside = _beside(tracked, truth)
    result = tracked.assign({name: ("time", one.values, dict(one.attrs)) for name, one in beside.items()})
    figures = (np.nan, np.nan, np.nan, 0)
    if found.usable is not None:
        figures = (found.usable.largest, found.usable.p95, found.usable.final, found.usable.samples)
    names = ("error_largest", "error_p95", "error_final", "error_samples")
    result.attrs |= dict(zip(names, figures, strict=True))
    if (live := live_of(tracked)) is not None and (usable := errors_of(live, truth).usable) is not None:
        result.attrs |= {f"{LIVE}error_largest": usable.largest, f"{LIVE}error_p95": usable.p95}
    result.attrs |= {"invalid_samples": found.invalid, "invalid_largest": found.invalid_largest}
    return result


def with_error(tracked: Signals, truth: Samples) -> Signals:
    """A track with the true position and the error beside it; arguments and errors as `judged`."""
    errors_of(tracked, truth)
    return Signals({**tracked.columns, **_beside(tracked, truth)}, tracked.attrs)


def _beside(tracked: Samples, truth: Samples) -> dict[str, Signal]:
    known = np.interp(tracked["time"].values, truth["time"].values, truth["position"].values, left=np.nan, right=np.nan)
    return {
        "true_position": Signal(known, {"units": "m", "long_name": "true position"}),
        "error": Signal(tracked["position"].values - known, {"units": "m", "long_name": "error of the position"}),
    }


def errors_of(tracked: Samples, truth: Samples) -> TrackErrors:
    """The errors of a track, those that the sensor reports are invalid apart.

    Args:
        tracked: with `position` [m], NaN where there is none, and `status` over `time` [s].
        truth: with `position` [m] over `time` [s], increasing.

    Raises:
        ComparisonError: the two have no time in common.
    """
    invalid = is_invalid(tracked["status"].values)
    time, position = tracked["time"].values, tracked["position"].values
    return track_errors(time, position, invalid, truth["time"].values, truth["position"].values)


def live_of(tracked: Samples) -> Signals | None:
    """What the live sensor said of a log that was looked back at; None of any other track."""
    names = ("position", "status")
    if any(f"{LIVE}{name}" not in tracked for name in names):
        return None
    columns = {name: Signal(tracked[f"{LIVE}{name}"].values, {}) for name in names}
    return Signals({"time": Signal(tracked["time"].values, {}), **columns})


def error_text(found: TrackErrors, samples: int) -> str:
    """One line on the errors of a track, in mm, how many samples they rest on, and a line on each kind left out."""
    lines = [f"error against the truth: {_usable_text(found.usable, samples)}"]
    if found.invalid:
        lines.append(f"  not counted: {found.invalid} invalid samples, largest {1e3 * found.invalid_largest:.3f} mm")
    if found.set_back:
        lines.append(f"  not counted: {found.set_back} samples whose clock was set back")
    return "\n".join(lines)


def _usable_text(found: PositionErrors | None, samples: int) -> str:
    if found is None:
        return f"none to be had, 0 of {samples} samples have a position where it is known"
    final = f"{1e3 * found.final:.3f} mm" if np.isfinite(found.final) else "unknown"
    return (
        f"largest {1e3 * found.largest:.3f} mm, 95 % within {1e3 * found.p95:.3f} mm, "
        f"final {final}; over {found.samples} of {samples} samples"
    )
