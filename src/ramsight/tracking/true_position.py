"""The true position that a track is compared with: where it is read, and whether a piston can have it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ramsight.errors import LogError
from ramsight.logs.channel_map import known_map
from ramsight.logs.channels import POSITION
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.opening import measured_signals
from ramsight.logs.truth import truth_signals
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import TIME, Samples, Signals
from ramsight.tracking.credible import credible_truth
from ramsight.tracking.position_errors import ComparisonError

if TYPE_CHECKING:
    import xarray

_FARTHEST = 3.0  # strokes; no measured position of a piston is farther from its retracted end


def known_position(
    truth: str | Path | xarray.Dataset | None,
    log: object,
    channel_map: ChannelMap | str | Path | None,
    unit: HydraulicUnit,
) -> Signals | None:
    """The true position of a log: as it is passed, of a file, or of the log itself.

    Args:
        truth: a file, or `position` [m] over `time` [s]; None: what the log holds itself, if its map names it.
        log: a file; anything else holds no true position.
        channel_map: of the log.
        unit: whose piston it is.

    Returns:
        `position` [m] over `time` [s], without samples where this piston cannot be, which a warning names; None if
        there is none.

    Raises:
        LogError: a file cannot be read, or has no number there.
        ComparisonError: no piston of this stroke can have that position.
    """
    if truth is None:
        known = truth_in(log, channel_map)
    else:
        known = truth_signals(truth) if isinstance(truth, str | Path) else Signals.of(truth)
    if known is None:
        return None
    source = next((str(one) for one in (truth, log) if isinstance(one, str | Path)), "true position")
    left = credible_truth(known, unit, source)
    possible_truth(left, float(unit.cylinder.stroke))
    return left


def truth_in(log: object, channel_map: ChannelMap | str | Path | None) -> Signals | None:
    """The true position that a log holds itself, where its map names one under `measured`.

    Args:
        log: a file; what is none holds none.
        channel_map: of the file.

    Returns:
        `position` [m] over the log's `time` [s], where there is a number; None if the map names none.

    Raises:
        LogError: the log cannot be read, or has no number there.
    """
    known = known_map(channel_map)
    if not isinstance(log, str | Path) or known is None or POSITION.name not in known.measured:
        return None
    measured = measured_signals(log, known)
    columns = {name: measured[name] for name in (TIME, POSITION.name)}
    found = Signals(columns).rows(np.isfinite(measured[POSITION.name].values))
    if not len(found):
        raise LogError(f"has no number of {known.measured[POSITION.name].channel}", file=str(log))
    return found


def possible_truth(truth: Samples, stroke: float) -> None:
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
