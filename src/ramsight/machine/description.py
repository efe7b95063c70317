"""A machine: one or more hydraulic units, each a circuit of parts."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Discriminator, Field, PrivateAttr, Tag, field_validator, model_validator
from pydantic_core import PydanticCustomError

from ramsight.errors import DescriptionError, UnknownNameError, one_line
from ramsight.machine import catalogue
from ramsight.machine.assumption_description import Assumptions
from ramsight.machine.base import Part, walk, with_models
from ramsight.machine.declare import refuse
from ramsight.machine.linkage import Linkage
from ramsight.machine.parts import (
    AnticavitationValve,
    Cylinder,
    Drive,
    Heat,
    Hose,
    Load,
    Manifold,
    Oil,
    Pump,
    ReliefValve,
    SafetyValve,
    Tank,
)
from ramsight.machine.placed import AnyPlaced, PlacedHose, has_volume, nodes_of
from ramsight.machine.pump_description import read_efficiencies
from ramsight.machine.requirement_description import Requirement
from ramsight.machine.spread import Spread, read_spread
from ramsight.machine.tolerances import Tolerances

#: the newest format of a description that this version reads
FORMAT = 1
#: the circuit of a description that gives all parts and nodes itself
IN_FULL = "parts"

_PART_NAME = re.compile(r"[a-z][a-z0-9_]*")
_RESERVED = ("tank", "oil", "cylinder", "drive", "oil_temperature")


def circuits() -> tuple[str, ...]:
    """What a description may name as its circuit."""
    return ("ddh", *catalogue.circuits(), IN_FULL)


class Unit(Part):
    """What every unit has: one motor, cylinders, a load, oil, and a circuit that joins them."""

    circuit: str
    load_direction: Annotated[
        Literal["extend", "retract"], Field(description="direction of motion that lifts the load")
    ]
    oil: Oil
    cylinder: Cylinder
    drive: Drive
    tank: Tank
    load: Load
    heat: Annotated[Heat | None, Field(description="what the heat of its losses is kept in")] = None
    requirement: Annotated[
        Requirement | None, Field(description="what its position has to achieve; what is measured is judged by it")
    ] = None
    assumptions: Annotated[Assumptions, Field(description="what a sensor assumes of it")] = Assumptions()
    tolerances: Annotated[Tolerances, Field(description="how far it may be from its description")] = Tolerances()

    def _repr_html_(self) -> str:
        from ramsight.machine.described_html import unit_html

        return unit_html(self)

    @property
    def lift_sign(self) -> int:
        """Sign of motor speed and velocity while the load is lifted, +1 extending, -1 retracting."""
        return 1 if self.load_direction == "extend" else -1

    @property
    def load_side(self) -> Literal["a", "b"]:
        """The chamber that holds the load, ``"a"`` (piston side) or ``"b"`` (rod side)."""
        return "a" if self.load_direction == "extend" else "b"

    @property
    def pumps(self) -> dict[str, Pump]:
        """The pumps by what to call them."""
        return {}

    @property
    def relief_settings(self) -> tuple[float, ...]:
        """Settings of all relief valves [Pa]."""
        return ()

    @model_validator(mode="after")
    def _stops_leave_a_way(self) -> Self:
        stops, stroke = self.assumptions.stops, self.cylinder.stroke
        for key in ("retracted", "extended"):
            if getattr(stops, key) and stops.retracted + stops.extended >= stroke:
                shown = f"{1e3 * getattr(stops, key):g} mm"
                text = "the machine's stops leave nothing of the stroke"
                raise refuse(f"assumptions.stops.{key}", shown, text, f"both together less than {1e3 * stroke:g} mm")
        return self

    @model_validator(mode="after")
    def _compression_fits_the_efficiency(self) -> Self:
        for name, pump in self.pumps.items():
            table = read_efficiencies(pump.efficiency_table) if pump.losses == "table" else None
            point = (pump.nominal_pressure,), (((pump.volumetric_efficiency,),),)
            pressures, pages = point if table is None else (table.pressure, table.volumetric)
            for row in (row for page in pages for row in page):
                for pressure, efficiency in zip(pressures, row, strict=True):
                    most = 1.0 - pump.compressed(pressure, self.oil.bulk_modulus)
                    if efficiency > most:
                        raise refuse(
                            f"{self._path_of(name)}.compression",
                            pump.compression,
                            f"the oil's compression at {pressure / 1e5:g} bar is more than a volumetric efficiency "
                            f"of {efficiency:g} leaves for it",
                            f'an efficiency of at most {most:.4f}, or "beside efficiency"',
                        )
        return self

    def _path_of(self, pump: str) -> str:
        """Where the description has a pump of `pumps`."""
        return pump

    def _check_hose(self, key: str, hose: Hose) -> None:
        if hose.effective_bulk_modulus > self.oil.bulk_modulus:
            raise refuse(
                f"{key}.effective_bulk_modulus",
                f"{hose.effective_bulk_modulus / 1e9:g} GPa",
                "oil and hose together cannot be stiffer than the oil alone",
                f"at most {self.oil.bulk_modulus / 1e9:g} GPa",
            )


class DirectDriven(Unit):
    """Direct-driven hydraulic (DDH) unit: a motor, a pump on each side, valves, hoses and cylinders."""

    circuit: Annotated[Literal["ddh"], Field(description="how the parts are joined")]
    pump_a: Annotated[Pump, Field(description="pump between tank and A (piston) side")]
    pump_b: Annotated[Pump, Field(description="pump between tank and B (rod) side")]
    manifold: Manifold
    hose: Hose
    relief_valve: ReliefValve
    anticavitation_valve: AnticavitationValve
    safety_valve: SafetyValve
    port_relief_valve: Annotated[
        ReliefValve | None,
        Field(description="relief valves of the cylinder's ports, from chamber to tank behind the safety valves"),
    ] = None

    @model_validator(mode="after")
    def _hose_is_softer_than_oil(self) -> Self:
        self._check_hose("hose", self.hose)
        return self

    @property
    def pumps(self) -> dict[str, Pump]:
        """The pumps by what to call them."""
        return {"pump A": self.pump_a, "pump B": self.pump_b}

    def _path_of(self, pump: str) -> str:
        return pump.lower().replace(" ", "_")

    @property
    def relief_settings(self) -> tuple[float, ...]:
        """Settings of all relief valves [Pa]."""
        return (self.relief_valve.setting,)


class Composed(Unit):
    """Unit whose circuit is described as parts on nodes, or taken from the catalogue's circuits by name."""

    circuit: Annotated[str, Field(description='name of a catalogue circuit that gives the nodes, or "parts"')]
    parts: Annotated[dict[str, AnyPlaced], Field(description="parts between nodes, by name")]

    @model_validator(mode="after")
    def _holds_together(self) -> Self:
        if self.circuit not in circuits():
            raise refuse("circuit", self.circuit, "unknown choice", ", ".join(circuits()))
        with_volume = {"tank", "chamber_a", "chamber_b"}
        for name, part in self.parts.items():
            if not _PART_NAME.fullmatch(name) or name in _RESERVED:
                text = "a part's name starts with a letter and holds small letters, digits and _"
                raise refuse(f"parts.{name}", name, f"{text}; {', '.join(_RESERVED)} are taken")
            if isinstance(part, PlacedHose):
                self._check_hose(f"parts.{name}", part)
            if has_volume(part):
                with_volume.update(nodes_of(part))
        for name, part in self.parts.items():
            for node in nodes_of(part):
                if node not in with_volume:
                    text = "no oil at this node: put a volume, hose or accumulator there"
                    raise refuse(f"parts.{name}", node, text, ", ".join(sorted(with_volume)))
        if not self.pumps:
            raise refuse("parts", len(self.parts), "the circuit has no pump")
        return self

    @property
    def pumps(self) -> dict[str, Pump]:
        """The pumps by what to call them."""
        return {name: part for name, part in self.parts.items() if isinstance(part, Pump)}

    def _path_of(self, pump: str) -> str:
        return f"parts.{pump}"

    @property
    def relief_settings(self) -> tuple[float, ...]:
        """Settings of all relief valves [Pa]."""
        return tuple(part.setting for part in self.parts.values() if isinstance(part, ReliefValve))


def _tag(value: Any) -> str:
    """Which class a unit is of; whatever is no unit at all is rejected by the first."""
    circuit = value.get("circuit", "ddh") if isinstance(value, dict) else getattr(value, "circuit", "ddh")
    return "@direct-driven" if circuit == "ddh" else "@composed"


AnyUnit = Annotated[
    Annotated[DirectDriven, Tag("@direct-driven")] | Annotated[Composed, Tag("@composed")], Discriminator(_tag)
]


def _on_one_line(text: str) -> str:
    """A text for headings, refused if it is of several lines."""
    if one_line(text) != text:
        raise PydanticCustomError("units", "{text}", {"text": "holds the end of a line, or another control character"})
    return text


class Machine(Part):
    """Machine description: its name, its hydraulic units and the mechanism that they move."""

    format: Annotated[Literal[1], Field(description="format of this file")] = 1
    name: Annotated[
        str, Field(description="short name, used in file names", min_length=1), AfterValidator(_on_one_line)
    ]
    title: Annotated[str, Field(description="name for headings"), AfterValidator(_on_one_line)] = ""
    description: Annotated[str, Field(description="a sentence about the machine")] = ""
    units: Annotated[dict[str, AnyUnit], Field(description="hydraulic units by name")]
    linkage: Annotated[
        Linkage | None, Field(description="mechanism that the units' cylinders move; without it each carries its load")
    ] = None

    _sources: dict[str, str] = PrivateAttr(default_factory=dict)
    _origin: str = PrivateAttr(default="")
    _tolerances: dict[str, str] = PrivateAttr(default_factory=dict)

    @field_validator("units")
    @classmethod
    def _at_least_one(cls, units: dict[str, Any]) -> dict[str, Any]:
        if not units:
            text = "a machine needs at least one unit, for example a table [units.boom]"
            raise PydanticCustomError("units", "{text}", {"text": text})
        return units

    @model_validator(mode="after")
    def _cylinders_belong_to_units(self) -> Self:
        for name in self.linkage.cylinders if self.linkage is not None else ():
            if name not in self.units:
                raise refuse(f"linkage.cylinders.{name}", name, "no such unit", ", ".join(self.units))
        return self

    def _repr_html_(self) -> str:
        from ramsight.machine.described_html import machine_html

        return machine_html(self.title or self.name, self.description, self.units)

    @property
    def sources(self) -> Mapping[str, str]:
        """Where each value comes from, by dotted path, as far as the description states."""
        return self._sources

    @property
    def tolerances(self) -> Mapping[str, Spread]:
        """Tolerances that stand beside values, by dotted path, in SI; those of a kind are a unit's `tolerances`.

        Example:
            >>> from ramsight import machine
            >>> boom = machine.template().replace('bore = "127 mm"', 'bore = "127 mm ± 0.1 mm"')
            >>> machine.loads(boom).tolerances["units.boom.cylinder.bore"].half
            0.0001
        """
        values = {value.path: value for value in walk(self)} if self._tolerances else {}
        found = {}
        for path, text in self._tolerances.items():
            value = values.get(path)
            if value is None or value.declared is None or value.declared.whole:
                raise DescriptionError("is no value that can have a tolerance", file=self.origin, key=path, value=text)
            try:
                found[path] = read_spread(text, value.declared, value.value)
            except DescriptionError as error:
                raise DescriptionError(
                    error.message, file=self.origin, key=path, value=text, allowed=error.allowed
                ) from None
        return found

    def tolerance_text(self, path: str) -> str | None:
        """The tolerance beside a value as it is written; None if there is none."""
        return self._tolerances.get(path)

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
            >>> machine.load_machine("mining-loader").unit("boom").cylinder.number
            2
        """
        try:
            return self.units[name]
        except (KeyError, TypeError):  # what is no text may not even be looked for
            raise UnknownNameError("unit", str(name), self.units, self.origin or None) from None

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
        """Return a copy with some values changed; see `Part.replace`. They lose their source, or have their model's."""
        every, sources = with_models(self, changes)
        copy = super().replace(every)
        copy._origin = self._origin
        copy._sources = _of_others(self._sources, every) | sources
        copy._tolerances = _of_others(self._tolerances, every)
        return copy


def _of_others(texts: Mapping[str, str], changed: Iterable[str]) -> dict[str, str]:
    """What is said of values, by dotted path, less what stands at or below paths that are changed."""
    ends = tuple(f"{path}." for path in changed)
    return {path: text for path, text in texts.items() if not f"{path}.".startswith(ends)}
