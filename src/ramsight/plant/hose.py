"""Hoses, lines and rigid volumes: resistance, inertia, content and the give of their walls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import casadi as ca

from ramsight.expression import Real
from ramsight.plant.oil import ATMOSPHERE

if TYPE_CHECKING:
    from ramsight.plant.circuit import Circuit

_FLOW_TOLERANCE = 1e-9  # m3/s


def laminar_resistance(viscosity: Real, density: Real, length: Real, diameter: Real) -> Real:
    """Pressure drop per flow of a round line [Pa/(m3/s)], Hagen-Poiseuille: 128 nu rho L/(pi d^4).

    Args:
        viscosity: kinematic [m2/s].
        density: [kg/m3].
        length: [m].
        diameter: [m].
    """
    return 128.0 * viscosity * density * length / (math.pi * diameter**4)


def stiffened_bulk_modulus(pressure: Real, bulk_modulus: Real, stiffening: Real) -> Real:
    """Bulk modulus of a hose with its oil [Pa] at a pressure: B + k (p - p_0), B below the atmosphere's pressure p_0.

    A braid first gives way to the wall and then locks, so that a hose stiffens under pressure.

    Args:
        pressure: absolute [Pa].
        bulk_modulus: B, of oil and wall together at the atmosphere's pressure [Pa].
        stiffening: k, rise of the modulus per pressure [1].

    Source: the first two terms of a modulus over pressure, as for oils (Gholizadeh, Burton and Schoenau, International
    Journal of Fluid Power 12 (2011) 3, 5-15); what a hose takes in then grows with the logarithm of the pressure, bent
    down like the curves of volumetric expansion that hose makers give.

    Example:
        >>> [round(float(stiffened_bulk_modulus(p, 15e6, 9.0)) / 1e6) for p in (1e5, 21e5, 51e5)]
        [15, 33, 60]
    """
    return bulk_modulus + stiffening * ca.fmax(pressure - ATMOSPHERE, 0.0)


@dataclass(frozen=True)
class Volume:
    """A rigid volume of oil at a node."""

    name: str
    node: str  # where it is
    volume: float  # [m3]

    def connect(self, circuit: Circuit) -> None:
        """Add the volume to its node."""
        circuit.volume(self.node, self.volume)


@dataclass(frozen=True)
class Hose:
    """A hose or pipe. Without inertia half its content belongs to either end; with it, it is cut into segments."""

    name: str
    # inlet, outlet: nodes; segments meet at nodes `name_1`, `name_2`, ..
    inlet: str
    outlet: str
    volume: float  # content [m3]
    # length, diameter: [m]
    length: float
    diameter: float
    bulk_modulus: float  # of oil and wall together [Pa], not above the oil's
    turbulent: bool = False  # whether flow turns turbulent (Blasius); else it is laminar whatever its speed
    # equal parts whose flows are states; 0 leaves the oil's inertia out. Waves are shown up to about a sixth of the
    # frequency of one segment.
    segments: int = 0
    # rise of the bulk modulus per pressure above the atmosphere's [1]; without it there is none
    stiffening: float | None = None

    @property
    def joins(self) -> tuple[str, ...]:
        """The nodes that have one pressure while nothing flows."""
        return (self.inlet, *(f"{self.name}_{k}" for k in range(1, self.segments)), self.outlet)

    passage = joins

    def flow(self, pressure_difference: Real, viscosity: Real, density: Real) -> Real:
        """Steady flow [m3/s] at a pressure difference [Pa], viscosity [m2/s] and density [kg/m3]."""
        flow = pressure_difference / laminar_resistance(viscosity, density, self.length, self.diameter)
        return flow * flow_over_laminar(self._reynolds(flow, viscosity)) if self.turbulent else flow

    def pressure_drop(self, flow: Real, viscosity: Real, density: Real) -> Real:
        """Steady pressure drop [Pa] at a flow [m3/s], viscosity [m2/s] and density [kg/m3]."""
        drop = flow * laminar_resistance(viscosity, density, self.length, self.diameter)
        return drop * drop_over_laminar(self._reynolds(flow, viscosity)) if self.turbulent else drop

    def _reynolds(self, flow: Real, viscosity: Real) -> Real:
        return 4.0 * ca.fabs(flow) / (math.pi * self.diameter * viscosity)

    def connect(self, circuit: Circuit) -> None:
        """Add content, the wall's compliance, flow and friction loss."""
        nodes = self.joins
        half = 0.5 * self.volume / max(self.segments, 1)
        for node in (*nodes[:-1], *nodes[1:]):
            circuit.volume(node, half)
            circuit.compliance(node, half * self._wall(circuit, node))
        if self.segments:
            self._with_inertia(circuit)
            return
        difference = circuit.pressure(self.inlet) - circuit.pressure(self.outlet)
        conductance = 1.0 / laminar_resistance(circuit.viscosity, circuit.density, self.length, self.diameter)
        if self.turbulent:
            reynolds = self._reynolds(conductance * difference, circuit.viscosity)
            conductance = circuit.coefficient(conductance * flow_over_laminar(reynolds))
        flow = conductance * difference
        circuit.flow(self.name, self.inlet, self.outlet, flow)
        circuit.loss(f"{self.name}.throttling", flow * difference)

    def _wall(self, circuit: Circuit, node: str) -> Real:
        """What the wall gives per pressure at a node, over the content [1/Pa]."""
        oil = circuit.oil.bulk_modulus
        if self.stiffening is None:
            return 1.0 / self.bulk_modulus - 1.0 / oil
        modulus = stiffened_bulk_modulus(circuit.pressure(node), self.bulk_modulus, self.stiffening)
        return ca.fmax(1.0 / modulus - 1.0 / oil, 0.0)

    def _with_inertia(self, circuit: Circuit) -> None:
        """Momentum of each segment: (rho L/A) dQ/dt = dp - dp_friction."""
        nodes = self.joins
        inertia = circuit.density * self.length / (0.25 * math.pi * self.diameter**2) / self.segments
        energy: Real = 0.0
        loss: Real = 0.0
        for k, (start, end) in enumerate(pairwise(nodes), 1):
            state = f"flow_{self.name}_{k}"
            flow = circuit.state(state, "m3/s", _FLOW_TOLERANCE)
            drop = self.pressure_drop(flow, circuit.viscosity, circuit.density) / self.segments
            circuit.flow(f"{self.name}.{k}", start, end, flow)
            circuit.derivative(state, (circuit.pressure(start) - circuit.pressure(end) - drop) / inertia)
            energy, loss = energy + 0.5 * inertia * flow**2, loss + drop * flow
        circuit.stored(f"{self.name}.inertia", energy)
        circuit.loss(f"{self.name}.throttling", loss)


# Friction in round pipes from laminar through transition to turbulent flow, without a step.
#
# Laminar below a Reynolds number of 2000 (64/Re), turbulent and smooth above 4000 (Blasius, 0.3164/Re^(1/4)), between
# them a cubic in logarithms that meets both with their slopes and is monotone. Holds up to a Reynolds number of 1e5.
#
# Source: H. Blasius, VDI-Forschungsheft 131 (1913); limits of the transition as in F. M. White, Fluid Mechanics, ch. 6.

# Reynolds numbers between which a flow may be either (White: 2000 to 4000), and Blasius's factor for smooth pipes.
_LAMINAR, _TURBULENT = 2000.0, 4000.0
_BLASIUS = 0.3164
_END = _BLASIUS * _TURBULENT**1.75 / 64.0  # what Re would be at 4000 if the flow were still laminar


def _cubic(share: Real, start: float, end: float, start_slope: float, end_slope: float) -> Real:
    """Hermite's cubic over 0 ... 1."""
    s2, s3 = share * share, share * share * share
    return (
        start * (2 * s3 - 3 * s2 + 1) + start_slope * (s3 - 2 * s2 + share) + end * (3 * s2 - 2 * s3)
        + end_slope * (s3 - s2)
    )  # fmt: skip


def _blend(value: Real, first: float, last: float, target: float, end_slope: float) -> Real:
    """In logarithms, the curve from (first, first) with slope 1 to (last, target) with `end_slope`, over `value`."""
    inside = ca.fmin(ca.fmax(value, first), last)
    span = math.log(last / first)
    share = ca.log(inside / first) / span
    curve = _cubic(share, 0.0, math.log(target / first), span, end_slope * span)
    return ca.exp(curve) * first / inside


def flow_over_laminar(laminar_reynolds: Real) -> Real:
    """Flow at a pressure difference over the flow that it would be if laminar [1], 1 or less.

    Args:
        laminar_reynolds: Reynolds number that the flow would have if it were laminar [1].

    Example:
        >>> round(float(flow_over_laminar(1000.0)), 3), round(float(flow_over_laminar(20000.0)), 3)
        (1.0, 0.298)
    """
    beyond = ca.fmax(laminar_reynolds, _END) / _END
    return _blend(laminar_reynolds, _LAMINAR, _END, _TURBULENT, 4.0 / 7.0) * ca.exp(-3.0 / 7.0 * ca.log(beyond))


def drop_over_laminar(reynolds: Real) -> Real:
    """Pressure drop at a flow over what it would be if laminar [1], 1 or more.

    Args:
        reynolds: Reynolds number of the flow [1].

    Example:
        >>> round(float(drop_over_laminar(1000.0)), 3), round(float(drop_over_laminar(10000.0)), 3)
        (1.0, 4.944)
    """
    beyond = ca.fmax(reynolds, _TURBULENT) / _TURBULENT
    return _blend(reynolds, _LAMINAR, _TURBULENT, _END, 1.75) * ca.exp(0.75 * ca.log(beyond))
