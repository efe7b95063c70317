"""How far a unit, its drive and its thermometer may be from what is described, where no single value says it.

A tolerance of a single value stands beside it (``bore = "127 mm ± 0.1 mm"``). These are of what many values share, or
of what no value describes: a factor on all of a kind (1 is the description), or what a drive and a thermometer are off
by. What is not stated has a default by its kind (`ramsight.study.datasheet`), and a data sheet marks it as such.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Self

from pydantic import Field, model_validator
from pydantic.fields import FieldInfo

from ramsight.errors import DescriptionError
from ramsight.machine.base import Part
from ramsight.machine.declare import Quantity, quantity, refuse
from ramsight.machine.spread import Spread, read_spread


@dataclass(frozen=True)
class Tolerated:
    """What a tolerance is of; stands in ``Annotated[str | None, Tolerated(...)]``."""

    of: Quantity

    @property
    def text(self) -> str:
        """What it is, for people."""
        return self.of.text


def _factor(text: str, *, least: str = "0.05", most: str = "20") -> Tolerated:
    return Tolerated(quantity("1", text, least=least, most=most))


def _of(unit: str, text: str, least: str, most: str) -> Tolerated:
    return Tolerated(quantity(unit, text, least=least, most=most))


_Text = str | None


class Tolerances(Part):
    """How far a machine may be from its description; each a text such as "± 5 % normal"."""

    leakage: Annotated[_Text, _factor("leakage of the pumps over the described one")] = None
    displacement: Annotated[_Text, _factor("displacement of the pumps over it", least="0.9", most="1.1")] = None
    pump_friction: Annotated[_Text, _factor("hydro-mechanical losses of the pumps over the described ones")] = None
    friction: Annotated[_Text, _factor("friction of the cylinder over the described one")] = None
    stiffness: Annotated[_Text, _factor("bulk modulus of oil and hoses over it")] = None
    volumes: Annotated[_Text, _factor("dead volumes, manifolds and hoses over the described ones")] = None
    valves: Annotated[_Text, _factor("flow of all valves at a pressure drop over it")] = None
    relief: Annotated[
        _Text, _factor("settings of the relief valves over the described ones", least="0.5", most="2")
    ] = None
    viscosity: Annotated[_Text, _factor("viscosity of the oil over the described one")] = None
    area: Annotated[_Text, _factor("areas of the cylinder over the described ones", least="0.9", most="1.1")] = None
    mass: Annotated[_Text, _factor("mass that moves with the rods over the described one")] = None
    stop: Annotated[_Text, _of("mm", "upper end stop less the described stroke", "-1 m", "1 m")] = None
    start: Annotated[
        _Text, _of("mm", "position that the sensor starts from, less the true one", least="-1 m", most="1 m")
    ] = None
    torque_gain: Annotated[_Text, _factor("reported torque over the true one", least="0.3", most="3")] = None
    torque_offset: Annotated[
        _Text, _of("%", "reported torque less the true one, over that at relief pressure", "-50 %", "50 %")
    ] = None
    torque_drift: Annotated[
        _Text, _of("%", "change of the torque's gain by the time the magnets are warm", "-50 %", "50 %")
    ] = None
    torque_delay: Annotated[_Text, _of("ms", "of the reported torque behind the speed", "0 ms", "1 s")] = None
    torque_noise: Annotated[_Text, _of("N m", "noise of the torque, std", "0 N m", "1000 N m")] = None
    thermometer_offset: Annotated[_Text, _of("delta_K", "reported temperature less the true one", "-50 K", "50 K")] = (
        None
    )
    thermometer_lag: Annotated[_Text, _of("s", "of the thermometer behind the oil", "0 s", "1 h")] = None
    oil_temperature: Annotated[_Text, _of("degC", "of the oil at the beginning", "-60 degC", "200 degC")] = None
    warming: Annotated[_Text, _of("delta_K", "of the oil over the duty", "-100 K", "100 K")] = None
    correlations: Annotated[
        dict[str, Annotated[float, quantity("1", "correlation of two of them", least=-1, most=1)]],
        Field(description="correlations of pairs, for example leakage-displacement = 0.5"),
    ] = {}  # noqa: RUF012 - of a model, which copies it

    @model_validator(mode="after")
    def _are_tolerances(self) -> Self:
        for name, declared in KINDS.items():
            text = getattr(self, name)
            if text is not None:
                try:
                    read_spread(text, declared, CENTRES.get(name))
                except DescriptionError as error:
                    raise refuse(name, text, error.message, error.allowed) from None
        for pair in self.correlations:
            if len(names := pair.split("-")) != 2 or not set(names) <= set(KINDS) or names[0] == names[1]:
                text = "is no pair of two tolerances"
                raise refuse(f"correlations.{pair}", pair, text, "for example leakage-displacement")
        return self

    def spread(self, name: str) -> Spread | None:
        """One of them as read; None if it is not stated."""
        text = getattr(self, name)
        return None if text is None else read_spread(text, KINDS[name], CENTRES.get(name))


def _declared(field: FieldInfo) -> Quantity | None:
    return next((one.of for one in field.metadata if isinstance(one, Tolerated)), None)


#: how a tolerance of each unit is written
EXAMPLES = {
    "1": "± 10 %", "%": "± 1 %", "mm": "± 1 mm", "ms": "10 ms ± 10 ms", "s": "30 s ± 20 s",
    "N m": "0.5 N m ± 0.2 N m", "delta_K": "5 K ± 2 K", "degC": "40 degC ± 15 K",
}  # fmt: skip
#: what each of them is, by name
KINDS: dict[str, Quantity] = {
    name: declared for name, field in Tolerances.model_fields.items() if (declared := _declared(field)) is not None
}
#: the value of those that are relative to the description, 1 of a factor and 0 of what something is off by
CENTRES: dict[str, float] = {
    name: 1.0 if declared.unit == "1" else 0.0
    for name, declared in KINDS.items()
    if declared.unit == "1" or name in ("stop", "start", "torque_offset", "torque_drift", "thermometer_offset")
}
