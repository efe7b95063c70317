"""What a description states of parts beyond what a built unit knows: models, and how many cylinders move together."""

from __future__ import annotations

from ramsight.machine.description import Composed, DirectDriven, Unit

BOTH_SIDES = {"relief": "relief_valve", "anticavitation": "anticavitation_valve", "safety": "safety_valve"}
"""Tables of a description that state one part for both sides, by what the parts are called."""


def notes(unit: Unit) -> dict[str, str]:
    """A word for each part whose description has more to say, by the part's name.

    Example:
        >>> from ramsight import machine
        >>> notes(machine.load_machine("mining-loader").unit("boom"))["pump_a"]
        'PGI100-2-008'
    """
    found = {}
    if unit.cylinder.number > 1:
        found["cylinder"] = f"{unit.cylinder.number} cylinders together"
    models = {}
    if isinstance(unit, DirectDriven):
        models = {"pump_a": unit.pump_a.model, "pump_b": unit.pump_b.model}
        for part, key in BOTH_SIDES.items():
            models |= {f"{part}_{side}": getattr(unit, key).model for side in "ab"}
    elif isinstance(unit, Composed):
        models = {name: getattr(part, "model", None) for name, part in unit.parts.items()}
    return found | {name: model for name, model in models.items() if model}
