"""Checks of a commissioning log, and of the track that a sensor makes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ramsight.calibration.identify import AS_DESCRIBED, Identification
from ramsight.calibration.identify_report import WORDS
from ramsight.calibration.leakage import LeakTest, LeakTestError, leak_test
from ramsight.calibration.loss_uncertainty import dependence
from ramsight.logs.mapped import ChannelMap
from ramsight.machine.requirement_description import Requirement
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.inputs.sample import REPORTED
from ramsight.sensor.status import Status, is_invalid
from ramsight.signals import Dataset
from ramsight.study.commissioning.finding import Finding, Verdict
from ramsight.tracking.end_visits import visits
from ramsight.tracking.plausible import implausible
from ramsight.tracking.requirement_check import require

_SHORTEST = 60.0  # s; a unit cannot meet both ends and lift some loads in less
_BAD = 0.01  # share of samples that may have no value, or no place in time
_PERIOD = 0.1  # s; samples of a drive's log are no farther apart
_GAP = 1.0  # s; a motor that turns moves a rod by centimetres meanwhile
_UNITS = "units and signs"
OF_TORQUE = f"{_UNITS} of torque"
_UNUSUAL = 2.0  # standard deviations that the sensor assumes, from which a machine is far from its description


def faultless(log: Dataset) -> Dataset:
    """The log without samples that lack a value or whose time does not increase."""
    whole = np.isfinite(log["time"].values)
    for name in REPORTED[1:]:
        whole &= np.isfinite(log[name].values)
    kept = log.isel(time=np.flatnonzero(whole))
    time = kept["time"].values
    later = time > np.concatenate([[-np.inf], np.maximum.accumulate(time)])[:-1]
    return kept.isel(time=np.flatnonzero(later))


def samples(log: Dataset) -> Finding:
    """How many samples there are, how far apart, and how many are of no use."""
    count, good = log.sizes["time"], faultless(log)
    time = good["time"].values
    if len(time) < 2:
        return Finding("samples", Verdict.FAILED, f"{count} samples, none of use", "log speed, torque and temperature")
    steps = np.diff(time)
    period = float(np.median(steps))
    bad, gap, lasts = 1.0 - len(time) / count, float(steps.max()), float(time[-1] - time[0])
    found = (
        f"{count} over {lasts:.0f} s, every {1e3 * period:.3g} ms, longest gap {gap:.3g} s, "
        f"{100 * bad:.2g} % without a value or out of order"
    )
    if lasts < _SHORTEST:
        return Finding("samples", Verdict.LOOK_TWICE, found, f"work the unit for {_SHORTEST:.0f} s and more")
    if period > _PERIOD:
        return Finding(
            "samples", Verdict.LOOK_TWICE, found, "log a sample every 1 to 100 ms: what happens between is unseen"
        )
    if bad > _BAD or gap > _GAP:
        return Finding("samples", Verdict.LOOK_TWICE, found, "find out why the logger loses samples")
    return Finding("samples", Verdict.PASSED, found)


def units_and_signs(log: Dataset, unit: HydraulicUnit, channel_map: ChannelMap | None) -> list[Finding]:
    """Whether time, speed, torque and temperature can be this machine's."""
    wrong = implausible(log, unit, channel_map)
    if wrong and wrong[0][0] == "noise":
        return [Finding("noise of torque", Verdict.LOOK_TWICE, *wrong[0][1].rsplit(": ", 1))]
    if not wrong:
        found = "time, speed, torque and oil temperature are within what this machine can do, lifting takes more torque"
        return [Finding(_UNITS, Verdict.PASSED, f"{found} than lowering")]
    remedy = "correct the channel map (unit, sign, scale) and log or read it again"
    return [Finding(f"{_UNITS} of {role}", Verdict.FAILED, text, remedy) for role, text in wrong]


def leakage(unit: HydraulicUnit, log: Dataset) -> tuple[Finding, LeakTest | None]:
    """Whether there is a leak test, and what it says of the pumps."""
    try:
        test = leak_test(unit, log)
    except LeakTestError as error:
        return Finding(
            "leak test", Verdict.LOOK_TWICE, str(error), "rehearse it: ramsight simulate --duty leak-test"
        ), None
    half, assumed = TWO_SIDED_95 * test.std, unit.assumptions.machine.leak
    found = f"leakage {test.factor:.3f} ± {half:.3f} of the data sheet, from {len(test.stretches)} stretches"
    found += f"; {dependence(test.per_kelvin, test.per_torque)}"
    if abs(test.factor - 1.0) - half > _UNUSUAL * assumed:
        remedy = (
            f"the sensor assumes 1 ± {_UNUSUAL * assumed:.2g}: check oil grade and thermometer, then describe the "
            "pump as it is (ramsight identify), or widen assumptions.machine.leak"
        )
        return Finding("leak test", Verdict.LOOK_TWICE, found, remedy), test
    return Finding("leak test", Verdict.PASSED, found), test


_UNSURE = 0.05  # share of the stroke; a band wider than that to either side says hardly where the rod is
_INVALID = 0.01  # share of samples that may be invalid
_HOLDS, _FAILS = 0.95, 0.5  # shares of samples within that band
_LEARNED = (("leak", "leakage"), ("displacement", "displacement"), ("compliance", "compliance"))


@dataclass(frozen=True)
class Contacts:
    """Visits that the sensor saw."""

    retracted: int
    extended: int
    elsewhere: int


def contacts(track: Dataset, stroke: float) -> Contacts:
    """Count the visits whose position is known.

    Args:
        track: as `visits` takes it.
        stroke: of the cylinder [m].
    """
    known = [one.where for one in visits(track, stroke) if np.isfinite(one.position)]
    return Contacts(*(known.count(name) for name in ("retracted", "extended", "elsewhere")))


def stops(track: Dataset, unit: HydraulicUnit) -> Finding:
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


def learned(track: Dataset) -> Finding:
    """What the sensor learned of the machine; nothing is wrong with that by itself."""
    last = track.isel(time=-1)
    factors = [
        f"{words} {float(last[f'{name}_factor']):.3f} ± {TWO_SIDED_95 * float(last[f'{name}_factor_std']):.3f}"
        for name, words in _LEARNED
    ]
    return Finding("learned by the sensor", Verdict.PASSED, f"{', '.join(factors)} of the data sheet")


def confidence(track: Dataset, motor_stands: bool, stroke: float) -> Finding:
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


def truth(track: Dataset) -> Finding:
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


CHECK = "requirement"
UNSTATED = Finding(
    CHECK,
    Verdict.OPEN,
    "none is stated: the verdict says whether the sensor works as described, not whether that is good enough",
    'state one: --require "5 mm", or requirement.error of the unit',
)


def requirement(
    track: Dataset, asked: Requirement | None, stroke: float, mending: Callable[[], list[str]] = list
) -> Finding:
    """Whether the track achieves what the position is required for.

    Args:
        track: as `require` takes it.
        asked: the requirement; None if there is none.
        stroke: of the cylinder [m].
        mending: what else would make the error smaller, the most first; called where the requirement is missed.
    """
    if asked is None:
        return UNSTATED
    check = require(track, asked, stroke)
    if not check.is_met:
        ways = [check.remedy, *mending()] if check.samples and check.error > asked.error else ["visit the end stops"]
        found = f"missed: {', '.join(check.missing)}; {check.text}"
        return Finding(CHECK, Verdict.FAILED, found, "; or ".join(filter(None, ways)))
    if check.is_vague:
        remedy = "errors of one log prove less than the band: describe the machine as it is, or add a reference"
        return Finding(CHECK, Verdict.LOOK_TWICE, f"the band is wider than what is required: {check.text}", remedy)
    return Finding(CHECK, Verdict.PASSED, check.text)


def identified(found: Identification) -> list[Finding]:
    """A finding for each factor that the log tells."""
    return [_factor(name, found) for name in WORDS]


def _factor(name: str, found: Identification) -> Finding:
    check, estimate = f"data sheet, {WORDS[name]}", found.factors[name]
    if not estimate.identified:
        return Finding(check, Verdict.OPEN, "not identifiable from this log")
    nominal, allowed = AS_DESCRIBED[name], found.judged_by[name]
    said = f"{estimate.value:.4f} ({estimate.low:.4f} to {estimate.high:.4f}), expected {nominal:g} ± {allowed:.2g}"
    follows = dependence(estimate.per_kelvin, estimate.per_torque)
    said += f"; {follows}" if follows else ""
    if estimate.low > nominal + allowed or estimate.high < nominal - allowed:
        remedy = "describe the machine as it is: ramsight identify --out tuned.toml"
        return Finding(check, Verdict.LOOK_TWICE, said, remedy)
    if found.is_vague(name):
        remedy = "not determined: its interval is wider than what it is judged by; lift and lower more loads"
        return Finding(check, Verdict.LOOK_TWICE, said, remedy)
    return Finding(check, Verdict.PASSED, said)
