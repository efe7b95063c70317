"""A directional valve: which chamber the pump feeds is a command, from outside the circuit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca

from ramsight.expression import Real
from ramsight.plant.valve import SETTLED, orifice_slope, seeping

if TYPE_CHECKING:
    from ramsight.plant.circuit import Circuit

Edge = tuple[str, str, str, Real, Real]
"""Name, node that oil leaves, node that it comes to, opening [1] and conductance when open [m3/s/sqrt(Pa)]."""


@dataclass(frozen=True)
class DirectionalValve:
    """A 4/2 or 4/3 directional valve, a spool whose position is commanded.

    At +1 the pump's line feeds port A and port B returns; at -1 it feeds port B and port A returns; at 0 all four edges
    are as its overlap leaves them.
    """

    name: str  # of the part; its command is the circuit's parameter `name.command`
    # pump_port, tank_port: nodes on the supply's side
    pump_port: str
    tank_port: str
    # port_a, port_b: nodes on the cylinder's side
    port_a: str
    port_b: str
    conductance: float  # Q_rated / sqrt(dp_rated) of one open edge [m3/s/sqrt(Pa)]
    # share of the spool's way from the middle at which an edge begins to open; negative, the edges are open in the
    # middle [1]
    overlap: float
    switching_time: float | None = None  # until the spool has gone 95 % of a step, first order [s]; at once without it
    # past the spool at each edge per pressure difference, times viscosity [m3/s/Pa m2/s]; none without it
    closed_leak: float | None = None

    @property
    def passage(self) -> tuple[tuple[str, str], ...]:
        """The nodes between which oil passes while the pump feeds port A."""
        return ((self.pump_port, self.port_a), (self.port_b, self.tank_port))

    joins = passage

    def opening(self, spool: Real, way: float) -> Real:
        """Opening of the edges that a spool beyond the middle uncovers one way, 0 to 1.

        Args:
            spool: its place, -1 to 1.
            way: 1 for those that feed port A, -1 for those that feed port B.
        """
        return ca.fmin(ca.fmax((way * spool - self.overlap) / (1.0 - self.overlap), 0.0), 1.0)

    def connect(self, circuit: Circuit) -> None:
        """Add the flow over each of the four edges, with its throttling loss, and the spool as an output."""
        spool = circuit.command(self.name)
        if self.switching_time is not None:
            state = f"spool_{self.name}"
            asked, spool = spool, circuit.state(state, "1", 1e-6)
            circuit.derivative(state, (asked - spool) * (SETTLED / self.switching_time))
        circuit.output(f"{self.name}.spool", "1", spool)
        for edge, source, target, opening, conductance in self.edges(spool):
            difference = circuit.pressure(source) - circuit.pressure(target)
            slope = opening * orifice_slope(conductance, difference)
            flow = seeping(circuit, circuit.coefficient(slope) * difference, self.closed_leak, difference)
            circuit.flow(f"{self.name}.{edge}", source, target, flow)
            circuit.loss(f"{self.name}.{edge}.throttling", flow * difference)

    def edges(self, spool: Real) -> tuple[Edge, ...]:
        """What the spool opens at a place, -1 to 1."""
        forward, back = self.opening(spool, 1.0), self.opening(spool, -1.0)
        return (
            ("pa", self.pump_port, self.port_a, forward, self.conductance),
            ("bt", self.port_b, self.tank_port, forward, self.conductance),
            ("pb", self.pump_port, self.port_b, back, self.conductance),
            ("at", self.port_a, self.tank_port, back, self.conductance),
        )


def metered(parts: Iterable[object]) -> bool:
    """Whether a valve among a unit's parts meters the rod: the motor's angle is not its travel then."""
    return any(isinstance(part, DirectionalValve) for part in parts)
