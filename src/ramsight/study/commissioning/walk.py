"""The walk through a log, check after check."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

from ramsight.calibration.identify import EVALUATIONS, Identification, identify
from ramsight.calibration.identify_record import IdentifyError
from ramsight.calibration.leakage import LeakTest
from ramsight.errors import LogWarning
from ramsight.logs.mapped import ChannelMap
from ramsight.machine.description import Unit
from ramsight.machine.requirement_description import Requirement
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import Dataset
from ramsight.study.commissioning import log_checks
from ramsight.study.commissioning.finding import Finding, Verdict
from ramsight.study.commissioning.kept_values import Change, table_text
from ramsight.study.commissioning.log_checks import identified, requirement
from ramsight.study.commissioning.wrong_values import WrongValue, description

STEPS = EVALUATIONS + 2
"""How often `advance` is called, at most."""

_STANDING = 0.2  # rad/s; two steps of a drive that reports whole rpm
_LATER = ("leak test", "description", "end stops", "sensor", "data sheet")
_FITS = 3.0  # standard deviations, within which a wrong value explains what contradicts the description
_CORRECT = "correct the description first"


@dataclass(frozen=True)
class Commissioning:
    """What was found of a log."""

    unit: str  # name of the unit
    findings: tuple[Finding, ...]  # of each check, in order
    log: Dataset  # what was judged
    # track: what the kalman sensor made of it, with the error where the truth is known; None if it was not asked
    track: Dataset | None = None
    leak_test: LeakTest | None = None  # what the leak test said, if there was one
    identification: Identification | None = None  # what was identified, if the position was measured
    wrong_value: WrongValue | None = None  # the value of the description that is likely wrong, if one is
    changes: tuple[Change, ...] = ()  # what was measured both now and at an earlier commissioning, if one was passed

    @property
    def verdict(self) -> Verdict:
        """The worst of the findings; what was not judged is none."""
        verdicts = {finding.verdict for finding in self.findings}
        return next((one for one in (Verdict.FAILED, Verdict.LOOK_TWICE) if one in verdicts), Verdict.PASSED)

    @property
    def reasons(self) -> tuple[Finding, ...]:
        """The findings that are not passed."""
        return tuple(finding for finding in self.findings if finding.verdict in (Verdict.FAILED, Verdict.LOOK_TWICE))

    @property
    def text(self) -> str:
        """The findings and the verdict, a line each."""
        reservations = f"{len(self.reasons)} reservation{'' if len(self.reasons) == 1 else 's'}"
        words = {
            Verdict.PASSED: "commissioned",
            Verdict.LOOK_TWICE: f"commissioned with {reservations}",
            Verdict.FAILED: "not commissioned",
        }
        table = [table_text(self.changes)] if self.changes else []
        return "\n".join([*(finding.text for finding in self.findings), *table, f"{self.unit}: {words[self.verdict]}"])


def walk(
    unit: HydraulicUnit,
    log: Dataset,
    track_of: Callable[[Dataset], Dataset],
    truth: Dataset | None = None,
    channel_map: ChannelMap | None = None,
    advance: Callable[[float], object] = lambda count: None,
    asked: Requirement | None = None,
    mending: Callable[[], list[str]] = list,
    described: Unit | None = None,
) -> Commissioning:
    """Look at a log, check after check; where units or signs are wrong the rest is not judged.

    Args:
        log: motor_speed [rad/s], motor_torque [N m] and oil_temperature [K] over time.
        track_of: gives the track of a log by the kalman sensor, which starts without a position; with `error` [m]
            if there is a truth.
        truth: measured `position` [m] over time, if there is one.
        asked: what the position is required for; None if that is not stated.
        described: the description that the unit was built of; None if there is none.
        mending: what would make the error smaller, the most first; called where the requirement is missed.
    """
    first = [log_checks.samples(log), *log_checks.units_and_signs(log, unit, channel_map)]
    failed = [finding for finding in first if finding.verdict is Verdict.FAILED]
    if failed:
        why = "the log cannot be this machine's as it is read"
        known, wrong = Finding("description", Verdict.OPEN, why), None
        if [one.check for one in failed] == [log_checks.OF_TORQUE]:
            known, wrong = _instead(unit, log, track_of, truth, described, known)
        later = (known if one == "description" else Finding(one, Verdict.OPEN, why) for one in _LATER)
        return Commissioning(unit.name, (*first, *later), log, wrong_value=wrong)
    good = log_checks.faultless(log)
    leaks, test = log_checks.leakage(unit, good)
    advance(1)
    track = track_of(log)
    stands = abs(float(good["motor_speed"].values[-1])) < _STANDING
    known, wrong = description(described, unit, good, track, test, truth)
    required = requirement(track, asked, unit.cylinder.stroke, list if wrong else mending)
    stopped, learned = log_checks.stops(track, unit), log_checks.learned(track)
    sure = log_checks.confidence(track, stands, unit.cylinder.stroke)
    if wrong is not None:
        learned = replace(learned, verdict=Verdict.OPEN, remedy=_CORRECT)
        sure, required = (_of_a_wrong_description(one) for one in (sure, required))
    found = [required, *first, leaks, known, stopped, learned, sure]
    advance(1)
    if truth is None or wrong is not None:
        why = "there is no measured position" if truth is None else _CORRECT
        found.append(Finding("data sheet", Verdict.OPEN, why))
        return Commissioning(unit.name, tuple(found), log, track, test, wrong_value=wrong)
    found.append(log_checks.truth(track))
    sheet, identification = _sheet(unit, good, truth, advance)
    return Commissioning(unit.name, (*found, *sheet), log, track, test, identification)


def _instead(
    unit: HydraulicUnit,
    log: Dataset,
    track_of: Callable[[Dataset], Dataset],
    truth: Dataset | None,
    described: Unit | None,
    otherwise: Finding,
) -> tuple[Finding, WrongValue | None]:
    """A wrong value of the description that explains a torque beyond what it allows, where one does."""
    good = log_checks.faultless(log)
    _, test = log_checks.leakage(unit, good)
    with warnings.catch_warnings():  # what they say is a finding already
        warnings.simplefilter("ignore", LogWarning)
        track = track_of(good)
    known, wrong = description(described, unit, good, track, test, truth)
    return (known, wrong) if wrong is not None and wrong.misfit < _FITS else (otherwise, None)


def _of_a_wrong_description(finding: Finding) -> Finding:
    """A finding whose remedy is that of the description."""
    return finding if finding.verdict in (Verdict.PASSED, Verdict.OPEN) else replace(finding, remedy=_CORRECT)


def _sheet(
    unit: HydraulicUnit, log: Dataset, truth: Dataset, advance: Callable[[float], object]
) -> tuple[list[Finding], Identification | None]:
    try:
        identification = identify(unit, log, truth, advance=advance)
    except IdentifyError as error:
        return [
            Finding("data sheet", Verdict.LOOK_TWICE, str(error), "lift and lower several loads, some seconds each")
        ], None
    return identified(identification), identification
