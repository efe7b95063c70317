"""The true position that a track is compared with: where it is read, and whether a piston can have it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ramsight.errors import LogError
from ramsight.logs import load_map, read_truth
from ramsight.logs.channels import POSITION
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.opening import read_measured
from ramsight.tracking.position_errors import ComparisonError

if TYPE_CHECKING:
    import xarray

_FARTHEST = 3.0  # strokes; no measured position of a piston is farther from its retracted end


def known_position(
    truth: str | Path | xarray.Dataset | None, log: object, channel_map: ChannelMap | str | Path | None, stroke: float
) -> xarray.Dataset | None:
    """The true position of a log: as it is passed, of a file, or of the log itself.

    Args:
        truth: a file, or `position` [m] over `time` [s]; None: what the log holds itself, if its map names it.
        log: a file; anything else holds no true position.
        channel_map: of the log.
        stroke: of the cylinder [m].

    Returns:
        `position` [m] over `time` [s]; None if there is none.

    Raises:
        LogError: a file cannot be read, or has no number there.
        ComparisonError: no piston of this stroke can have that position.
    """
    if truth is None:
        known = truth_in(log, channel_map)
    else:
        known = read_truth(truth) if isinstance(truth, str | Path) else truth
    if known is not None:
        possible_truth(known, stroke)
    return known


def truth_in(log: object, channel_map: ChannelMap | str | Path | None) -> xarray.Dataset | None:
    """The true position that a log holds itself, where its map names one under `measured`.

    Args:
        log: a file; what is none holds none.
        channel_map: of the file.

    Returns:
        `position` [m] over the log's `time` [s], where there is a number; None if the map names none.

    Raises:
        LogError: the log cannot be read, or has no number there.
    """
    known = load_map(channel_map) if isinstance(channel_map, str | Path) else channel_map
    if not isinstance(log, str | Path) or known is None or POSITION.name not in known.measured:
        return None
    measured = read_measured(log, known)
    found = measured[[POSITION.name]].isel(time=np.flatnonzero(np.isfinite(measured[POSITION.name].values)))
    if not found.sizes["time"]:
        raise LogError(f"has no number of {known.measured[POSITION.name].channel}", file=str(log))
    return found


def possible_truth(truth: xarray.Dataset, stroke: float) -> None:
    """Reject a true position that no piston of this stroke can have; it is most often in another unit.

    Args:
        truth: `position` [m].
        stroke: of the cylinder [m].

    Raises:
        ComparisonError: it goes farther than three strokes.
    """
    farthest = float(np.nanmax(np.abs(truth["position"].values), initial=0.0))
    if farthest > _FARTHEST * stroke:
        hint = ": is it in mm?" if farthest * 1e-3 <= _FARTHEST * stroke else ""
        raise ComparisonError(f"the true position reaches {farthest:.5g} m, the stroke is {stroke:g} m{hint}")
