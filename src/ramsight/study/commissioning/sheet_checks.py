"""The data sheet against what was identified with a position sensor on the machine."""

from __future__ import annotations

from ramsight.calibration.identify import AS_DESCRIBED, Identification
from ramsight.calibration.identify_report import WORDS
from ramsight.calibration.loss_uncertainty import dependence
from ramsight.study.commissioning.finding import Finding, Verdict


def identified(found: Identification) -> list[Finding]:
    """A finding for each factor that the log tells.

    Args:
        found: of the machine.
    """
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
