"""What to say of a tracked log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.sensor.status import Status
from ramsight.study.errors import position_errors

if TYPE_CHECKING:
    import xarray


def track_columns(tracked: xarray.Dataset) -> dict[str, Any]:
    """The columns of a track: time_s, position_m, position_std_m, status in words."""
    words = {int(status): status.text for status in Status}
    return {
        "time_s": tracked["time"].values,
        "position_m": tracked["position"].values,
        "position_std_m": tracked["position_std"].values,
        "status": np.array([words[int(code)] for code in tracked["status"].values]),
    }


def track_summary(tracked: xarray.Dataset) -> str:
    """One line on where the piston is now, and one on each doubt."""
    time, position = tracked["time"].values, tracked["position"].values
    lines = [
        f"{tracked.attrs['sensor']} sensor: {len(time)} samples over {time[-1] - time[0]:.1f} s, "
        f"position {1e3 * position[0]:.1f} mm at first, {1e3 * position[-1]:.1f} mm at last"
    ]
    codes, counts = np.unique(tracked["status"].values, return_counts=True)
    for code, count in zip(codes, counts, strict=True):
        if code != Status.OK:
            lines.append(f"  {100 * count / len(time):.1f} % of the samples {Status(int(code)).text}")
    return "\n".join(lines)


def error_summary(tracked: xarray.Dataset, truth: xarray.Dataset) -> str:
    """The largest, the 95th-percentile and the final error in mm.

    Raises:
        ComparisonError: the two have no time in common.
    """
    found = position_errors(
        tracked["time"].values, tracked["position"].values, truth["time"].values, truth["position"].values
    )
    return (
        f"error: largest {1e3 * found.largest:.3f} mm, 95 % within {1e3 * found.p95:.3f} mm, "
        f"final {1e3 * found.final:.3f} mm"
    )
