"""The check valve that a pilot pressure opens backwards."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca

from ramsight.expression import Real
from ramsight.plant.valve import orifice_slope, seeping

if TYPE_CHECKING:
    from ramsight.plant.circuit import Circuit

_PILOT_RANGE = 2e5  # Pa at the seat, from shut to fully open, [G]


@dataclass(frozen=True)
class PilotCheckValve:
    """A check valve that a pilot pressure opens the other way too.

    It opens backwards in proportion, from where the pilot's force over the seat exceeds what presses the cone shut
    until a further 2 bar at the seat.
    """

    name: str
    # inlet, outlet: nodes; oil passes freely from inlet to outlet
    inlet: str
    outlet: str
    pilot: str  # node whose pressure opens it
    cracking_pressure: float  # of the free direction, and of the spring [Pa]
    conductance: float  # Q / sqrt(pressure difference) when open [m3/s/sqrt(Pa)]
    pilot_ratio: float  # area of the pilot piston over that of the seat [1]
    # past the closed valve per pressure difference, times viscosity [m3/s/Pa m2/s]; none without it
    closed_leak: float | None = None

    def opening(self, inlet: Real, outlet: Real, pilot: Real) -> Real:
        """How far the pilot holds it open, 0 to 1, at absolute pressures [Pa]."""
        surplus = self.pilot_ratio * (pilot - inlet) - (outlet - inlet) - self.cracking_pressure
        return ca.fmin(ca.fmax(surplus / _PILOT_RANGE, 0.0), 1.0)

    def slopes(self, difference: Real, spring: Real, opening: Real) -> tuple[Real, Real]:
        """Flow over pressure difference [m3/s/Pa]: of the free way, beyond the spring's pressure, and of the way back.

        Args:
            difference: from inlet to outlet [Pa].
            spring: pressure difference at which the free way opens [Pa].
            opening: how far the pilot holds it open [1].
        """
        free = ca.if_else(difference > spring, orifice_slope(self.conductance, difference - spring), 0.0)
        back = ca.if_else(difference < 0.0, opening * orifice_slope(self.conductance, difference), 0.0)
        return free, back

    def flow(self, inlet: Real, outlet: Real, pilot: Real, coefficient: Callable[[Real], Real] = lambda e: e) -> Real:
        """Flow from inlet to outlet [m3/s].

        Args:
            inlet: absolute pressure [Pa].
            outlet: absolute pressure [Pa].
            pilot: absolute pressure [Pa].
        """
        difference, opening = inlet - outlet, self.opening(inlet, outlet, pilot)
        spring = (1.0 - opening) * self.cracking_pressure  # the pilot takes the spring's part
        free, back = (coefficient(slope) for slope in self.slopes(difference, spring, opening))
        return free * (difference - coefficient(spring)) + back * difference

    def connect(self, circuit: Circuit) -> None:
        """Add the flow, its throttling loss and the opening as an output."""
        inlet, outlet, pilot = (circuit.pressure(node) for node in (self.inlet, self.outlet, self.pilot))
        flow = self.flow(inlet, outlet, pilot, circuit.coefficient)
        flow = seeping(circuit, flow, self.closed_leak, inlet - outlet)
        circuit.flow(self.name, self.inlet, self.outlet, flow)
        circuit.loss(f"{self.name}.throttling", flow * (inlet - outlet))
        circuit.output(f"{self.name}.opening", "1", self.opening(inlet, outlet, pilot))
