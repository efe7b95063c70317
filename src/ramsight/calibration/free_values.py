"""Which values of a description may be found from measured runs, and how far each may be from where it stands."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ramsight.machine.parts import Hose, Pump
from ramsight.machine.placed import PlacedAccumulator, PlacedDirectional, PlacedOrifice, PlacedVolume

if TYPE_CHECKING:
    from ramsight.machine.description import Composed, Machine

# Standard deviations of the logarithm of a value before anything is measured.
_MADE = 0.05  # what is turned or bored to a size, with how a data sheet rounds it
_GUESSED = 1.0  # what nobody measured: a factor of e either way
_TYPICAL = 0.5  # what parts of a kind have in common
_EFFICIENCY = 0.7  # of what an efficiency lacks to 1
_RUBBED = 0.1  # the same of the hydro-mechanical one: the torque's gain says the same at speed
_GAS = 0.1  # between slow and fast
_FILLED = 0.3  # a pressure that somebody set by a gauge

_PUMP = {"displacement": _MADE, "no_load_torque": _TYPICAL, "viscous_drag": _GUESSED}
_LOSSES = {"volumetric_efficiency": _EFFICIENCY, "hydromechanical_efficiency": _RUBBED}
_PARTS: tuple[tuple[type, dict[str, float]], ...] = (
    (Pump, _PUMP),
    (Hose, {"effective_bulk_modulus": _GUESSED, "stiffening": _GUESSED, "diameter": _TYPICAL}),
    (PlacedVolume, {"volume": _GUESSED}),
    (PlacedAccumulator, {"precharge": _FILLED, "gas_exponent": _GAS}),
    (PlacedDirectional, {"rated_flow": _GUESSED, "switching_time": _GUESSED}),
    (PlacedOrifice, {"rated_flow": _GUESSED}),
)
_UNIT = {
    "oil.free_air": _GUESSED, "cylinder.rod": _MADE, "cylinder.coulomb_friction": _GUESSED,
    "drive.moment_of_inertia": _GUESSED,
}  # fmt: skip
_TIED = {"cylinder.coulomb_friction": "cylinder.breakaway_friction"}
"""A value that goes with another in proportion, so that the description stays one that can be."""


@dataclass(frozen=True)
class FreeValue:
    """A value of a unit's description that is to be found."""

    key: str  # its path in the unit
    value: float  # as described [SI]
    std: float  # of the logarithm of the value, or of what an efficiency lacks to 1
    loss: bool = False  # whether it is an efficiency

    def at(self, change: float) -> float:
        """The value, in SI units, after a change of its logarithm.

        Args:
            change: of the logarithm of the value, or of what an efficiency lacks to 1 [1].

        Example:
            >>> FreeValue("parts.pump.volumetric_efficiency", 0.9, 0.7, loss=True).at(0.0)
            0.9
        """
        return 1.0 - (1.0 - self.value) * math.exp(change) if self.loss else self.value * math.exp(change)


def free_values(unit: Composed) -> tuple[FreeValue, ...]:
    """What is not known of a unit before it has been measured; values that are zero stay zero."""

    def found() -> Iterator[FreeValue]:
        for name, part in unit.parts.items():
            for kind, keys in _PARTS:
                if isinstance(part, kind):
                    for key, std in keys.items():
                        yield FreeValue(f"parts.{name}.{key}", getattr(part, key), std)
            if isinstance(part, Pump):
                for key, std in _LOSSES.items():
                    yield FreeValue(f"parts.{name}.{key}", getattr(part, key), std, loss=True)
        for key, std in _UNIT.items():
            head, _, last = key.partition(".")
            yield FreeValue(key, getattr(getattr(unit, head), last), std)

    return tuple(one for one in found() if one.value > 0.0 and not (one.loss and one.value >= 1.0))


def with_values(machine: Machine, unit: str, values: dict[str, float]) -> Machine:
    """The description with other values of one unit, by their paths in it [SI]."""
    path = f"units.{unit}"
    described = machine.unit(unit)
    changed: dict[str, Any] = {f"{path}.{key}": value for key, value in values.items() if key not in _TIED}
    result = machine.replace(changed) if changed else machine
    for key, with_it in _TIED.items():
        if key in values:
            head, _, first = key.partition(".")
            before = getattr(getattr(described, head), first)
            other = getattr(getattr(described, head), with_it.rpartition(".")[2])
            both = [(key, values[key]), (with_it, max(other * values[key] / before, values[key]))]
            # One after the other, and breakaway may not be below Coulomb friction in between.
            for one, value in both if values[key] < before else reversed(both):
                result = result.replace({f"{path}.{one}": value})
    return result
