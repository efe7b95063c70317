"""The energy account of a unit as what a page draws: what came in, where it went, and what share came back."""

from __future__ import annotations

import math
from typing import Any

from ramsight.duty.live_energy import EnergyAccount
from ramsight.plant.hose import Hose
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit
from ramsight.plant.valve import ReliefValve

_OF_PUMPS = {"leakage": "pumps: leakage", "friction": "pumps: friction", "belt": "belts"}
_OF_CYLINDER = {"friction": "cylinder: friction", "stop": "end stops"}
_STORED = "stored, tank and air"


def flows(unit: HydraulicUnit, account: EnergyAccount) -> dict[str, Any]:
    """Energies in kJ, by what people call them.

    Args:
        unit: whose parts tell what a loss is.
        account: of its circuit.

    Returns:
        `in` and `out`, energies by words, which are the same sum but for `missing`; `regenerated`, what the motor took
        back over what the load gave, and `recovered`, over what the motor gave, None where there was nothing.
    """
    kinds = {part.name: part for part in unit.parts()}
    out = {"load": account.lifted, "back to the drive": account.taken}
    for name, energy in account.losses.items():
        words = _words(kinds, name)
        out[words] = out.get(words, 0.0) + energy
    came = {"drive": account.given, "load comes down": account.lowered}
    kept = sum(account.works.values()) + sum(account.stored.values())
    (out if kept >= 0.0 else came)[_STORED] = abs(kept)
    return {
        "in": {name: _kj(energy) for name, energy in came.items()},
        "out": {name: _kj(energy) for name, energy in out.items()},
        "missing": _kj(account.missing),
        "regenerated": _share(account.taken, account.lowered),
        "recovered": _share(account.taken, account.given),
    }


def _words(kinds: dict[str, Any], loss: str) -> str:
    """What people call a loss of the circuit."""
    name, _, how = loss.partition(".")
    part = kinds.get(name)
    if isinstance(part, Pump):
        return _OF_PUMPS.get(how, "pumps: other")
    if isinstance(part, ReliefValve):
        return "relief valves"
    if isinstance(part, Hose):
        return "hoses"
    if how.endswith("throttling"):
        return "other valves"
    return _OF_CYLINDER.get(how, "cylinder: seal and cushions")


def _kj(energy: float) -> float:
    return round(energy / 1e3, 3) + 0.0


def _share(part: float, whole: float) -> float | None:
    share = part / whole if whole > 1.0 else math.nan  # J; less is nothing that was moved
    return round(share, 4) if math.isfinite(share) else None
