"""What a machine is: descriptions in TOML, checked and in SI, and the catalogue of parts with their sources.

Example:
    >>> from ramsight import machine
    >>> boom = machine.load_machine("mining-loader").unit("boom")
    >>> round(boom.cylinder.bore, 4), boom.load_direction
    (0.127, 'extend')
"""

from typing import TYPE_CHECKING

from ramsight.late import late
from ramsight.machine import catalogue
from ramsight.machine.assumption_description import Assumptions
from ramsight.machine.base import Part, Value, walk
from ramsight.machine.declare import Quantity, quantity
from ramsight.machine.description import FORMAT, Composed, DirectDriven, Machine, Unit
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
from ramsight.machine.reading import AnyMachine, from_catalogue, load_machine, loads, only_unit

if TYPE_CHECKING:
    from ramsight.machine.template_text import json_schema, template
else:
    __getattr__, __dir__ = late(__name__)

__all__ = [
    "FORMAT", "AnticavitationValve", "AnyMachine", "Assumptions", "Composed", "Cylinder", "DirectDriven", "Drive",
    "Hose", "Load", "Machine", "Manifold", "Oil", "Part", "Pump", "Quantity", "ReliefValve", "SafetyValve", "Tank",
    "Unit", "Value", "catalogue", "from_catalogue", "json_schema", "load_machine", "loads", "only_unit", "quantity",
    "template", "walk",
]  # fmt: skip
