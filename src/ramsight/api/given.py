"""Data sets that a caller gives: whether they have what is needed of them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.errors import DescriptionError, LogError, MissingColumnError
from ramsight.logs import load_map, read_truth
from ramsight.logs.channels import POSITION
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.opening import read_measured
from ramsight.sensor.virtual_sensor import REPORTED
from ramsight.study.errors import ComparisonError

if TYPE_CHECKING:
    import xarray

_FARTHEST = 3.0  # strokes that no measured position of a piston goes


def checked(given: Any, name: str, needed: Iterable[str] = REPORTED) -> xarray.Dataset:
    """A Dataset that has what is needed of it.

    Args:
        given: a Dataset, one hopes.
        name: of the argument, for messages.
        needed: names of variables; by default those of a drive log.

    Raises:
        DescriptionError: it is none.
        MissingColumnError: a variable is absent.
    """
    import xarray

    if not isinstance(given, xarray.Dataset):
        raise DescriptionError("is no Dataset", key=name, value=given, allowed="a file, or an xarray.Dataset over time")
    missing = [one for one in needed if one not in given.variables]
    if missing:
        raise MissingColumnError(file=name, missing=missing, found=[str(one) for one in given.variables])
    return given


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


def truth_of(truth: str | Path | xarray.Dataset) -> xarray.Dataset:
    """The true position, from a file or as it is given.

    Raises:
        LogError: the file cannot be read, or a variable is absent.
        DescriptionError: it is neither file nor Dataset.
    """
    return read_truth(truth) if isinstance(truth, str | Path) else checked(truth, "truth", ("time", "position"))


def possible_truth(truth: xarray.Dataset, stroke: float) -> None:
    """Refuse a true position that no piston of this stroke can have; it is most often in another unit.

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
