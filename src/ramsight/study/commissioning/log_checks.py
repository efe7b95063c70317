"""Whether a log is one: its samples, its units and signs, its leak test."""

from __future__ import annotations

import numpy as np

from ramsight.calibration.leakage import LeakTest, LeakTestError, leak_test
from ramsight.calibration.loss_uncertainty import dependence
from ramsight.logs.mapped import ChannelMap
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.inputs.sample import REPORTED
from ramsight.signals import Dataset
from ramsight.study.commissioning.finding import Finding, Verdict
from ramsight.tracking.plausible import implausible

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
