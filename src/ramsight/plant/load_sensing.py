"""Load sensing: a pump that delivers what a metering valve asks for, at a little more than the load's pressure.

The valve tells the pump through a line of its own which pressure the fed port has; the pump swivels so that its outlet
is by a margin above that. So the flow goes with the valve's opening alone, and the margin is lost over its edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca

from ramsight.expression import Real
from ramsight.plant.circuit import TANK
from ramsight.plant.directional import DirectionalValve, Edge
from ramsight.plant.pump import Pump
from ramsight.plant.valve import SETTLED

if TYPE_CHECKING:
    from ramsight.plant.circuit import Circuit

_SENSED_FROM = 0.05  # of an edge's opening; there the sensing bore is uncovered, before the edge passes much


@dataclass(frozen=True, kw_only=True)
class LoadSensingPump(Pump):
    """A pump of variable displacement that keeps its outlet by a margin above the pressure of a sensing line.

    Leakage and friction are those of a pump at full displacement, whatever it swivels to, as in Wilson's law: gaps and
    loaded surfaces do not get smaller with it. So it is worse at part displacement, and turns with losses when idle.
    """

    load_line: str = TANK  # node whose pressure it answers
    margin: float  # of its outlet above the sensing line, at which it delivers nothing [Pa]
    cut_off: float  # pressure rise at which it delivers nothing, whatever is sensed [Pa]
    band: float  # below margin or cut-off within which it goes to full displacement [Pa]
    swivel_time: float  # until it has gone 95 % of a step, first order [s]

    def asked(self, outlet: Real, inlet: Real, sensed: Real) -> Real:
        """Share of the displacement that its control asks for, 0 to 1.

        Args:
            outlet: pressure there [Pa].
            inlet: pressure there [Pa].
            sensed: pressure of the sensing line [Pa].
        """
        short = ca.fmin(sensed + self.margin, inlet + self.cut_off) - outlet
        return ca.fmin(ca.fmax(short / self.band, 0.0), 1.0)

    def swivel(self, circuit: Circuit) -> Real:
        """Share of the displacement that it moves per revolution [1], a state."""
        name = f"swivel_{self.name}"
        share = circuit.state(name, "1", 1e-6)
        outlet, inlet, sensed = (circuit.pressure(node) for node in (self.outlet, self.inlet, self.load_line))
        circuit.derivative(name, (self.asked(outlet, inlet, sensed) - share) * (SETTLED / self.swivel_time))
        circuit.output(f"{self.name}.swivel", "1", share)
        return share


@dataclass(frozen=True, kw_only=True)
class MeteringValve(DirectionalValve):
    """A proportional directional valve that tells a load-sensing pump the pressure of the port that it feeds."""

    load_line: str  # node of the sensing line
    sensing: float  # Q / sqrt(dp) of the bore from the fed port to that line [m3/s/sqrt(Pa)]

    def edges(self, spool: Real) -> tuple[Edge, ...]:
        """The four edges, and the bores that lead from the fed port to the sensing line."""
        main = super().edges(spool)
        opening = {edge[0]: ca.fmin(edge[3] / _SENSED_FROM, 1.0) for edge in main}
        return (
            *main,
            ("sense_a", self.port_a, self.load_line, opening["pa"], self.sensing),
            ("sense_b", self.port_b, self.load_line, opening["pb"], self.sensing),
        )
