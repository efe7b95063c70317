"""The description of what carries the oil: manifolds and hoses."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ramsight.machine.base import Part
from ramsight.machine.declare import count, quantity


class Manifold(Part):
    """Block that carries pump and valves, one side alike the other."""

    volume: Annotated[float, quantity("l", "oil in the manifold, per side", least="1e-4 l", most="100 l")]


class Hose(Part):
    """Hose between manifold and cylinders, one side alike the other."""

    volume: Annotated[float, quantity("l", "oil in the hose, per side", least="1e-4 l", most="1000 l")]
    length: Annotated[float, quantity("m", "length, for the resistance", least="0.001 m", most="100 m")]
    diameter: Annotated[float, quantity("mm", "inner diameter, for the resistance", above="1 mm", most="200 mm")]
    effective_bulk_modulus: Annotated[
        float,
        quantity("GPa", "bulk modulus of oil and hose wall together", least="0.001 GPa", most="5 GPa"),
    ]
    stiffening: Annotated[
        float,
        quantity("1", "rise of that modulus per pressure above the atmosphere's; 0 for none", least="0", most="50"),
    ] = 0.0
    regime: Annotated[
        Literal["laminar", "turbulent"], Field(description="laminar whatever the speed, or turning turbulent")
    ] = "laminar"
    segments: Annotated[int, count("segments whose oil has inertia; 0 leaves it out", least=0, most=50)] = 0
