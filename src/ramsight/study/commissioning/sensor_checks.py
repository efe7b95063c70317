"""What the sensor makes of a log: the end stops it met, what it learned, how sure it is, and whether that is true."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ramsight.normal import TWO_SIDED_95
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.status import Status, is_invalid
from ramsight.study.commissioning.finding import Finding, Verdict
from ramsight.tracking.end_visits import visits

if TYPE_CHECKING:
    import xarray

_UNSURE = 0.05  # share of the stroke; a band wider than that to either side says hardly where the rod is
_INVALID = 0.01  # share of samples that may be invalid
_HOLDS, _FAILS = 0.95, 0.5  # shares of samples within that band
_LEARNED = (("leak", "leakage"), ("displacement", "displacement"), ("compliance", "compliance"))


@dataclass(frozen=True)
class Contacts:
    """Visits that the sensor saw.

    Attributes:
        retracted, extended: of the two ends.
        elsewhere: of something between them.
    """

    retracted: int
    extended: int
    elsewhere: int


def contacts(track: xarray.Dataset, stroke: float) -> Contacts:
    """Count the visits whose position is known.

    Args:
        track: as `visits` takes it.
        stroke: of the cylinder [m].
    """
    known = [one.where for one in visits(track, stroke) if np.isfinite(one.position)]
    return Contacts(*(known.count(name) for name in ("retracted", "extended", "elsewhere")))


def stops(track: xarray.Dataset, unit: HydraulicUnit) -> Finding:
    """Whether the unit was at both ends."""
    seen = contacts(track, unit.cylinder.stroke)
    found = f"visits to the retracted end: {seen.retracted}, to the extended end: {seen.extended}"
    if seen.elsewhere:
        found += f"; contacts between them: {seen.elsewhere}"
    if not seen.retracted and not seen.extended:
        return Finding("end stops", Verdict.FAILED, found, "drive against both ends: without them nothing is known")
    if not (seen.retracted and seen.extended) or seen.retracted + seen.extended < 3:
        remedy = "three visits, both ends among them, tell position, leakage and displacement"
        return Finding("end stops", Verdict.LOOK_TWICE, found, remedy)
    if seen.elsewhere:
        return Finding("end stops", Verdict.LOOK_TWICE, found, "look for what stops the rod, or check the stroke")
    return Finding("end stops", Verdict.PASSED, found)


def learned(track: xarray.Dataset) -> Finding:
    """What the sensor learned of the machine; nothing is wrong with that by itself."""
    last = track.isel(time=-1)
    factors = [
        f"{words} {float(last[f'{name}_factor']):.3f} ± {TWO_SIDED_95 * float(last[f'{name}_factor_std']):.3f}"
        for name, words in _LEARNED
    ]
    return Finding("learned by the sensor", Verdict.PASSED, f"{', '.join(factors)} of the data sheet")


def confidence(track: xarray.Dataset, motor_stands: bool, stroke: float) -> Finding:
    """How sure the sensor is in the end, and whether it called the inputs invalid."""
    status = track["status"].values
    wrong = status > int(Status.TOO_UNCERTAIN)  # an input; a position that is not sure enough yet is another matter
    last, invalid = Status(int(status[-1])), float(np.mean(wrong))
    found = f"in the end {last.text}"
    if last.validity in ("not referenced", "invalid"):
        return Finding("sensor", Verdict.FAILED, found, "drive against an end stop, and look at the log's inputs")
    band = TWO_SIDED_95 * float(track["position_std"][-1])
    found += f", ± {1e3 * band:.1f} mm (95 %)"
    if band > _UNSURE * stroke:
        return Finding("sensor", Verdict.LOOK_TWICE, found, "end the log with a visit to an end stop")
    if invalid > _INVALID:
        codes, counts = np.unique(status[wrong], return_counts=True)
        why = Status(int(codes[np.argmax(counts)])).text
        return Finding(
            "sensor", Verdict.LOOK_TWICE, f"{found}; {100 * invalid:.2g} % of the samples {why}", "find out why"
        )
    if last is not Status.OK:
        return Finding("sensor", Verdict.LOOK_TWICE, found, "end the log with a visit to an end stop")
    if not motor_stands:
        return Finding("sensor", Verdict.LOOK_TWICE, f"{found}; the motor turns at the end of the log", "end at rest")
    return Finding("sensor", Verdict.PASSED, found)


def truth(track: xarray.Dataset) -> Finding:
    """Whether the position is as wrong as the sensor reports; what it says is invalid is not judged.

    Args:
        track: with `error` and `position_std` [m], and `status`.
    """
    error, std = np.abs(track["error"].values), track["position_std"].values
    both = np.isfinite(error) & np.isfinite(std)
    known = both & ~is_invalid(track["status"].values)
    if not known.any():
        return Finding("truth", Verdict.OPEN, "no sample has both a valid estimate and a true position")
    within = float(np.mean(error[known] <= TWO_SIDED_95 * std[known]))
    found = (
        f"95 % of the errors within {1e3 * float(np.percentile(error[known], 95.0)):.2f} mm, largest "
        f"{1e3 * float(error[known].max()):.2f} mm; the 95 % band holds {100 * within:.1f} % of {known.sum()} samples"
    )
    if both.sum() > known.sum():
        found += f"; {both.sum() - known.sum()} invalid ones are not counted"
    if within >= _HOLDS:
        return Finding("truth", Verdict.PASSED, found)
    verdict = Verdict.LOOK_TWICE if within >= _FAILS else Verdict.FAILED
    return Finding("truth", verdict, found, "describe the machine as it was identified, or widen the assumptions")
