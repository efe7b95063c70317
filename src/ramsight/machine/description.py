"""A machine: one or more hydraulic units, each a circuit of parts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, PrivateAttr, field_validator, model_validator
from pydantic_core import PydanticCustomError

from ramsight.errors import UnknownNameError
from ramsight.machine.declare import Part, refuse
from ramsight.machine.parts import (
    AnticavitationValve,
    Cylinder,
    Drive,
    Hose,
    Load,
    Manifold,
    Oil,
    Pump,
    ReliefValve,
    SafetyValve,
    Tank,
)

#: the newest format of a description that this version reads
FORMAT = 1


class Unit(Part):
    """Direct-driven hydraulic (DDH) unit: a motor, a pump on each side, valves, hoses and cylinders."""

    circuit: Annotated[Literal["ddh"], Field(description="how the parts are joined")]
    load_direction: Annotated[
        Literal["extend", "retract"], Field(description="direction of motion that lifts the load")
    ]
    oil: Oil
    cylinder: Cylinder
    pump_a: Annotated[Pump, Field(description="pump between tank and A (piston) side")]
    pump_b: Annotated[Pump, Field(description="pump between tank and B (rod) side")]
    drive: Drive
    manifold: Manifold
    hose: Hose
    tank: Tank
    relief_valve: ReliefValve
    anticavitation_valve: AnticavitationValve
    safety_valve: SafetyValve
    load: Load

    @model_validator(mode="after")
    def _hose_is_softer_than_oil(self) -> Self:
        if self.hose.effective_bulk_modulus > self.oil.bulk_modulus:
            raise refuse(
                "hose.effective_bulk_modulus",
                f"{self.hose.effective_bulk_modulus / 1e9:g} GPa",
                "oil and hose together cannot be stiffer than the oil alone",
                f"at most {self.oil.bulk_modulus / 1e9:g} GPa",
            )
        return self

    @property
    def lift_sign(self) -> int:
        """Sign of motor speed and velocity while the load is lifted: +1 extending, -1 retracting."""
        return 1 if self.load_direction == "extend" else -1

    @property
    def load_side(self) -> Literal["a", "b"]:
        """The chamber that holds the load, ``"a"`` (piston side) or ``"b"`` (rod side)."""
        return "a" if self.load_direction == "extend" else "b"

    @property
    def hose_compliance(self) -> float:
        """Relative volume that the hose wall gives per pressure, 1/beta_effective - 1/beta_oil [1/Pa]."""
        return 1 / self.hose.effective_bulk_modulus - 1 / self.oil.bulk_modulus


class Machine(Part):
    """Machine description: its name and its hydraulic units."""

    format: Annotated[Literal[1], Field(description="format of this file")] = 1
    name: Annotated[str, Field(description="short name, used in file names", min_length=1)]
    title: Annotated[str, Field(description="name for headings")] = ""
    description: Annotated[str, Field(description="a sentence about the machine")] = ""
    units: Annotated[dict[str, Unit], Field(description="hydraulic units by name")]

    _sources: dict[str, str] = PrivateAttr(default_factory=dict)
    _origin: str = PrivateAttr(default="")

    @field_validator("units")
    @classmethod
    def _at_least_one(cls, units: dict[str, Unit]) -> dict[str, Unit]:
        if not units:
            text = "a machine needs at least one unit, for example a table [units.boom]"
            raise PydanticCustomError("units", "{text}", {"text": text})
        return units

    @property
    def sources(self) -> Mapping[str, str]:
        """Where each value comes from, by dotted path, as far as the description says."""
        return self._sources

    @property
    def origin(self) -> str:
        """The file or catalogue name that the machine was read from; empty if built in Python."""
        return self._origin

    def unit(self, name: str) -> Unit:
        """Return one unit.

        Args:
            name: its name in the description.

        Raises:
            UnknownNameError: there is no such unit; the text lists those that exist.

        Example:
            >>> from ramsight import machine
            >>> machine.load("mining-loader").unit("boom").cylinder.number
            2
        """
        try:
            return self.units[name]
        except KeyError:
            raise UnknownNameError("unit", name, self.units, self.origin or None) from None

    def source_of(self, path: str) -> str | None:
        """Return where a value comes from: its own source, or that of the nearest table around it.

        Args:
            path: dotted path, for example ``"units.boom.cylinder.bore"``.
        """
        while path:
            if path in self._sources:
                return self._sources[path]
            path = path.rpartition(".")[0]
        return None

    def replace(self, changes: Mapping[str, Any]) -> Self:
        """Return a copy with some values changed; see `Part.replace`. Changed values lose their source."""
        copy = super().replace(changes)
        copy._sources = {
            path: source
            for path, source in self._sources.items()
            if not any(path == key or path.startswith(f"{key}.") for key in changes)
        }
        copy._origin = self._origin
        return copy
