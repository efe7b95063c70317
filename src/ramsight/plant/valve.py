"""Valves: what they let pass at a pressure difference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca

from ramsight.expression import Real, Scalar

if TYPE_CHECKING:
    from ramsight.plant.circuit import Circuit

CLOSED_POINT = 46e-6 / 250e5
"""Viscosity over pressure at which the leakage of closed valves is stated [m2/s/Pa]; data sheets take the highest."""
SETTLED = 3.0
"""Time constants after which a first-order opening counts as done, 95 %."""
_POPPET = 0.03  # s, until a relief valve's poppet has followed, 95 %; data sheets state 20 to 80 ms
_LAMINAR = 2e3  # Pa; below about this difference an orifice's flow is laminar (linear), so its slope stays finite


def orifice_slope(conductance: Real, pressure_difference: Real) -> Scalar:
    """Flow of an orifice over its pressure difference [m3/s/Pa]: G / sqrt|dp|, level near zero.

    Args:
        conductance: G = Q_rated / sqrt(dp_rated) [m3/s/sqrt(Pa)].
        pressure_difference: [Pa].
    """
    magnitude = ca.sqrt(pressure_difference * pressure_difference + _LAMINAR * _LAMINAR)
    return conductance / ca.sqrt(magnitude)


def orifice_flow(conductance: Real, pressure_difference: Real) -> Scalar:
    """Flow through an orifice [m3/s]: G sign(dp) sqrt|dp|, made linear near zero; arguments as `orifice_slope`."""
    return orifice_slope(conductance, pressure_difference) * pressure_difference


def seeping(circuit: Circuit, flow: Real, leak: Real | None, pressure_difference: Real) -> Real:
    """A valve's flow with what passes its closed seat or spool, a laminar gap [m3/s]: Q + k dp / nu.

    Args:
        flow: Q, of the valve itself [m3/s].
        leak: k, flow per pressure difference times viscosity [m3/s/Pa m2/s]; None for a tight one.
        pressure_difference: [Pa].
    """
    return flow if leak is None else flow + leak / circuit.viscosity * pressure_difference


@dataclass(frozen=True)
class ReliefValve:
    """Opens at its setting; the flow then grows linearly with the pressure."""

    name: str
    inlet: str
    outlet: str
    setting: float  # pressure difference at which it opens [Pa]
    conductance: float  # flow per pressure above the setting [m3/s/Pa]
    # past the closed valve per pressure difference, times viscosity [m3/s/Pa m2/s]; none without it
    closed_leak: float | None = None
    pilot_flow: float | None = None  # of its pilot at the setting and beyond [m3/s]; none without it
    pilot_opens: float | None = None  # share of the setting from which the pilot's flow grows [1]
    reseats: float | None = None  # share of the setting at which it shuts again [1]; at the setting without it

    def connect(self, circuit: Circuit) -> None:
        """Add the flow and its throttling loss."""
        difference = circuit.pressure(self.inlet) - circuit.pressure(self.outlet)
        # A load held at its limit keeps the valve at its setting to the last digit: a maximum has half the slope there,
        # and rounding does not decide between none and all of it.
        flow: Real = self.conductance * ca.fmax(self._felt(circuit, difference) - self.setting, 0.0)
        flow = seeping(circuit, flow, self.closed_leak, difference)
        if self.pilot_flow is not None and self.pilot_opens is not None:
            beyond = (difference / self.setting - self.pilot_opens) / (1.0 - self.pilot_opens)
            flow = flow + self.pilot_flow * ca.fmin(ca.fmax(beyond, 0.0), 1.0)
        circuit.flow(self.name, self.inlet, self.outlet, flow)
        circuit.loss(f"{self.name}.throttling", flow * difference)

    def _felt(self, circuit: Circuit, difference: Scalar) -> Scalar:
        """Pressure difference that the poppet follows [Pa]: with hysteresis it lags behind one that falls.

        Friction holds it where it is until the difference has fallen by what lies between setting and reseating (a play
        of that width), so a valve that has opened shuts there, and passes more on the way down than on the way up.
        """
        if self.reseats is None:
            return difference
        state = f"felt_{self.name}"
        felt, play = circuit.state(state, "Pa", 10.0), (1.0 - self.reseats) * self.setting
        follows = ca.fmax(difference - felt, 0.0) + ca.fmin(difference + play - felt, 0.0)
        circuit.derivative(state, follows * (SETTLED / _POPPET))
        return ca.fmin(felt, difference + play)


@dataclass(frozen=True)
class CheckValve:
    """Lets oil pass one way, above a cracking pressure; here as the anti-cavitation valve."""

    name: str
    # inlet, outlet: nodes; oil passes from inlet to outlet only
    inlet: str
    outlet: str
    cracking_pressure: float  # pressure difference at which it opens [Pa]
    conductance: float  # Q / sqrt(pressure difference above cracking) [m3/s/sqrt(Pa)]
    # past the closed valve per pressure difference, times viscosity [m3/s/Pa m2/s]; none without it
    closed_leak: float | None = None

    def connect(self, circuit: Circuit) -> None:
        """Add the flow and its throttling loss."""
        difference = circuit.pressure(self.inlet) - circuit.pressure(self.outlet)
        beyond = difference - self.cracking_pressure
        # It leaves its seat within the first of these pascals: at no difference at all, rounding must not decide.
        opening = ca.fmin(ca.fmax(beyond / _LAMINAR, 0.0), 1.0)
        slope = circuit.coefficient(opening * orifice_slope(self.conductance, beyond))
        flow = seeping(circuit, slope * beyond, self.closed_leak, difference)
        circuit.flow(self.name, self.inlet, self.outlet, flow)
        circuit.loss(f"{self.name}.throttling", flow * difference)


@dataclass(frozen=True)
class Orifice:
    """A fixed orifice."""

    name: str
    inlet: str
    outlet: str
    conductance: float  # Q / sqrt(pressure difference) [m3/s/sqrt(Pa)]

    @property
    def passage(self) -> tuple[str, ...]:
        """The nodes between which oil passes either way."""
        return (self.inlet, self.outlet)

    def connect(self, circuit: Circuit) -> None:
        """Add the flow and its throttling loss."""
        difference = circuit.pressure(self.inlet) - circuit.pressure(self.outlet)
        flow = circuit.coefficient(orifice_slope(self.conductance, difference)) * difference
        circuit.flow(self.name, self.inlet, self.outlet, flow)
        circuit.loss(f"{self.name}.throttling", flow * difference)


@dataclass(frozen=True)
class SafetyValve:
    """A seat valve with free flow towards the cylinder, opened the other way by the motor's speed."""

    name: str
    # pump_side, cylinder_side: nodes; pump side to cylinder side is always free
    pump_side: str
    cylinder_side: str
    conductance: float  # Q_rated / sqrt(dp_rated) when open [m3/s/sqrt(Pa)]
    # motor speed at which the command opens it [rad/s]; a sign gives the direction. It is fully open at twice this
    # speed.
    opening_speed: float
    # until it is 95 % open after a step of the command, first order [s]; at once without it
    opening_time: float | None = None
    commanded: bool = True  # false for a valve that is held open all the time
    # past the closed valve per pressure difference, times viscosity [m3/s/Pa m2/s]; none without it
    closed_leak: float | None = None

    @property
    def passage(self) -> tuple[str, ...]:
        """The nodes between which oil passes, at least while it is open."""
        return (self.pump_side, self.cylinder_side)

    def command(self, motor_speed: Real) -> Scalar:
        """Opening that the motor's speed [rad/s] asks for, 0 to 1."""
        return ca.fmin(ca.fmax(motor_speed / self.opening_speed - 1.0, 0.0), 1.0)

    def slope(self, pressure_difference: Real, opening: Real) -> Scalar:
        """Flow towards the cylinder over a pressure difference [m3/s/Pa] at that difference [Pa] and an opening."""
        slope = orifice_slope(self.conductance, pressure_difference)
        return ca.if_else(pressure_difference > 0.0, slope, opening * slope)

    def connect(self, circuit: Circuit) -> None:
        """Add the flow, its throttling loss and the opening as an output."""
        difference = circuit.pressure(self.pump_side) - circuit.pressure(self.cylinder_side)
        if self.commanded:
            opening = self.command(circuit.motor_speed)
            if self.opening_time is not None:
                state = f"opening_{self.name}"
                asked, opening = opening, circuit.state(state, "1", 1e-6)
                circuit.derivative(state, (asked - opening) * (SETTLED / self.opening_time))
            slope = self.slope(difference, opening)
            circuit.output(f"{self.name}.opening", "1", opening)
        else:
            slope = orifice_slope(self.conductance, difference)
        flow = seeping(circuit, circuit.coefficient(slope) * difference, self.closed_leak, difference)
        circuit.flow(self.name, self.pump_side, self.cylinder_side, flow)
        circuit.loss(f"{self.name}.throttling", flow * difference)
