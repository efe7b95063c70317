"""The data sheet against what was identified with a position sensor on the machine."""

from __future__ import annotations

from ramsight.calibration.identify import Estimate, Identification
from ramsight.calibration.identify_report import WORDS
from ramsight.calibration.loss_uncertainty import dependence
from ramsight.plant.unit import HydraulicUnit
from ramsight.study.commissioning.finding import Finding, Verdict

_UNUSUAL = 2.0  # standard deviations that the sensor assumes
_FRICTION = 0.5  # of the data sheet's, from which friction is far from it
_EFFICIENCY = 0.02  # what pumps of one type differ by


def identified(unit: HydraulicUnit, found: Identification) -> list[Finding]:
    """A finding for each factor that the log tells.

    Args:
        unit: as its data sheet has it.
        found: of the machine.
    """
    assumed = unit.assumptions.machine
    allowed = {
        "leak": (1.0, _UNUSUAL * assumed.leak),
        "orifice": (0.0, _UNUSUAL * assumed.leak),
        "displacement": (1.0, _UNUSUAL * assumed.displacement),
        "stiffness": (1.0, _UNUSUAL * assumed.compliance),
        "friction": (1.0, _FRICTION),
        "efficiency": (0.0, _EFFICIENCY),
    }
    return [_factor(name, found.factors[name], *allowed[name]) for name in WORDS]


def _factor(name: str, estimate: Estimate, nominal: float, allowed: float) -> Finding:
    check = f"data sheet, {WORDS[name]}"
    if not estimate.identified:
        return Finding(check, Verdict.OPEN, "not identifiable from this log")
    found = f"{estimate.value:.4f} ({estimate.low:.4f} to {estimate.high:.4f}), expected {nominal:g} ± {allowed:.2g}"
    follows = dependence(estimate.per_kelvin, estimate.per_torque)
    found += f"; {follows}" if follows else ""
    beyond = estimate.low > nominal + allowed or estimate.high < nominal - allowed
    if beyond:
        return Finding(
            check, Verdict.LOOK_TWICE, found, "describe the machine as it is: ramsight identify --out tuned.toml"
        )
    return Finding(check, Verdict.PASSED, found)
