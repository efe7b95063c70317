"""The catalogue's unit of each circuit, which studies work with."""

from __future__ import annotations

from ramsight import machine
from ramsight.plant.build import build
from ramsight.plant.unit import HydraulicUnit

CIRCUITS = {
    "direct driven": ("mining-loader", "boom"),
    "double rod": ("eha-test-bench", "axis"),
    "pilot check": ("eha-single-rod", "axis"),
    "press": ("press", "ram"),
    "forklift": ("forklift-mast", "lift"),
}
"""Machine and unit by the circuit's name."""


def catalogued(name: str, unit: str) -> HydraulicUnit:
    """A unit of the catalogue as its data sheet has it."""
    return build(machine.load_machine(name).unit(unit), unit)
