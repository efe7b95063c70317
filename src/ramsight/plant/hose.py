"""Hoses and rigid volumes: resistance, content and the give of their walls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ramsight.plant.circuit import Circuit


def laminar_resistance(viscosity: Any, density: Any, length: Any, diameter: Any) -> Any:
    """Pressure drop per flow of a round line [Pa/(m3/s)], Hagen-Poiseuille: 128 nu rho L/(pi d^4).

    Args:
        viscosity: kinematic [m2/s].
        density: [kg/m3].
        length: [m].
        diameter: [m].
    """
    return 128.0 * viscosity * density * length / (math.pi * diameter**4)


@dataclass(frozen=True)
class Volume:
    """A rigid volume of oil at a node.

    Args:
        name: of the part.
        node: where it is.
        volume: [m3].
    """

    name: str
    node: str
    volume: float

    def connect(self, circuit: Circuit) -> None:
        """Add the volume to its node."""
        circuit.volume(self.node, self.volume)


@dataclass(frozen=True)
class Hose:
    """A hose with laminar flow; half its content belongs to either end.

    Args:
        name: of the part.
        inlet, outlet: nodes.
        volume: content [m3].
        length, diameter: [m].
        bulk_modulus: of oil and wall together [Pa], not above the oil's.
    """

    name: str
    inlet: str
    outlet: str
    volume: float
    length: float
    diameter: float
    bulk_modulus: float

    def connect(self, circuit: Circuit) -> None:
        """Add content, the wall's compliance, flow and friction loss."""
        half = 0.5 * self.volume
        for node in (self.inlet, self.outlet):
            circuit.volume(node, half)
            circuit.compliance(node, half * (1.0 / self.bulk_modulus - 1.0 / circuit.oil.bulk_modulus))
        difference = circuit.pressure(self.inlet) - circuit.pressure(self.outlet)
        resistance = laminar_resistance(circuit.viscosity, circuit.oil.density, self.length, self.diameter)
        flow = difference / resistance
        circuit.flow(self.name, self.inlet, self.outlet, flow)
        circuit.loss(f"{self.name}.throttling", flow * difference)
