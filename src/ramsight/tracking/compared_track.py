"""A track beside the true position: its errors, and the figures that follow from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ramsight.sensor.status import is_invalid
from ramsight.sensor.virtual_sensor import LIVE
from ramsight.signals import Samples, Signal, Signals
from ramsight.tracking.position_errors import PositionErrors, TrackErrors, track_errors

if TYPE_CHECKING:
    import xarray


def judged(tracked: xarray.Dataset, truth: Samples) -> xarray.Dataset:
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
    """One line on the errors of a track, in mm, how many samples they rest on, and a line on each kind left out.

    Args:
        found: the errors.
        samples: of the track.
    """
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
