"""A pump that also works as a motor: displacement, leakage and friction in all four quadrants.

The paper's eqs 3-10; eq. 7 with the absolute value that its text lost, eq. 10 in the form for pumps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import casadi as ca

from ramsight.expression import Real, Scalar
from ramsight.plant.valve import orifice_flow, orifice_slope

if TYPE_CHECKING:
    from ramsight.plant.circuit import Circuit
    from ramsight.plant.loss_table import LossTable


def leak_coefficient(
    displacement: Real,
    volumetric_efficiency: Real,
    nominal_speed: Real,
    nominal_pressure: Real,
    nominal_viscosity: Real,
    nominal_density: Real,
    viscosity: Real,
    density: Real,
) -> Real:
    """Leakage per pressure difference K_HP [m3/s/Pa], eq. 10: Hagen-Poiseuille flow through the nominal gap.

    Args:
        displacement: [m3/rad].
        volumetric_efficiency: at the nominal point [1].
        nominal_speed: pump speed of the nominal point [rad/s].
        nominal_pressure: pressure difference of the nominal point [Pa].
        nominal_viscosity: kinematic viscosity of the nominal point [m2/s].
        nominal_density: density of the nominal point [kg/m3].
        viscosity: kinematic viscosity now [m2/s].
        density: density now [kg/m3].

    Example:
        >>> from math import pi
        >>> k = leak_coefficient(31.6e-6 / (2 * pi), 0.90, 151.84, 250e5, 46e-6, 872.0, 32e-6, 872.0)
        >>> f"{k:.3e}"
        '4.391e-12'
    """
    gap = displacement * nominal_speed / nominal_pressure * (1.0 - volumetric_efficiency)
    return gap * (nominal_viscosity * nominal_density) / (viscosity * density)


def friction_coefficient(displacement: Real, hydromechanical_efficiency: Real) -> Real:
    """Friction torque per pressure difference K_TP [N m/Pa], eq. 8: D (eta_v/eta_tot - 1) = D (1/eta_hm - 1).

    Args:
        displacement: [m3/rad].
        hydromechanical_efficiency: at the nominal point [1].
    """
    return displacement * (1.0 / hydromechanical_efficiency - 1.0)


def friction_torque(no_load_torque: Real, coefficient: Real, pressure_rise: Real, speed: Real, threshold: Real) -> Real:
    """Friction torque [N m], eq. 7: (tau_0 + K_TP |dp|) tanh(4 w/w_th), against the rotation.

    Args:
        no_load_torque: tau_0 [N m].
        coefficient: K_TP [N m/Pa].
        pressure_rise: from inlet to outlet [Pa].
        speed: pump speed [rad/s].
        threshold: speed at which friction is fully developed, w_th [rad/s].
    """
    return (no_load_torque + coefficient * ca.fabs(pressure_rise)) * ca.tanh(4.0 * speed / threshold)


@dataclass(frozen=True)
class Pump:
    """A pump/motor between two nodes, driven by the motor through a belt."""

    name: str
    # inlet, outlet: nodes; positive speed moves oil from inlet to outlet
    inlet: str
    outlet: str
    displacement: float  # of all its chambers together [m3/rad]
    belt: float  # pump speed over motor speed [1]
    # volumetric_efficiency, hydromechanical_efficiency: at the nominal point [1]
    volumetric_efficiency: float
    hydromechanical_efficiency: float
    # nominal_speed, nominal_pressure, nominal_viscosity, nominal_density: the nominal point [SI]
    nominal_speed: float
    nominal_pressure: float
    nominal_viscosity: float
    nominal_density: float
    no_load_torque: float  # of all its blocks together [N m]
    threshold_speed: float  # for friction [rad/s]
    leak_factor: float = 1.0  # leakage over the data sheet's, for wear [1]
    # further leakage through worn edges, Q / sqrt(pressure rise) [m3/s/sqrt(Pa)]; none without it
    orifice_leak: float | None = None
    table: LossTable | None = None  # measured losses; with it the nominal point and the no-load torque are not used
    # friction torque over that of the law or the table, for wear [1]; none without it
    friction_factor: float | None = None
    # torque per speed that the oil in the gaps takes at the nominal viscosity [N m s/rad], beside eq. 7; it goes with
    # the viscosity (Wilson's law). None without it; a table has it in itself.
    drag: float | None = None
    # share of the nominal flow that the nominal efficiency has as the oil's compression [1]; with it oil is drawn with
    # the density of one side and delivered with that of the other. Without it volume is kept.
    compressed: float | None = None
    # torque per squared speed that the oil's inertia takes [N m s2/rad2], beside eq. 7 and the drag (Schlösser's fourth
    # term). None without it.
    hydrodynamic_drag: float | None = None
    belt_loss: float | None = None  # share of the pump's torque that the belt loses [1]; none without it
    # share of its speed by which the pump falls behind the belt's ratio at the nominal pressure's torque, the belt
    # stretching with what it pulls [1]; none without it
    belt_creep: float | None = None
    # flow over the root of the absolute pressure of the side that it draws from, at most [m3/s/sqrt(Pa)]; beyond that
    # its chambers do not fill. Without it they always do.
    filling: float | None = None

    @property
    def geared_displacement(self) -> float:
        """Displacement per motor angle [m3/rad]."""
        return self.displacement * self.belt

    def leak_coefficient(self, viscosity: Real, density: Real) -> Real:
        """K_HP [m3/s/Pa] with this oil, eq. 10."""
        kept = self.volumetric_efficiency
        return self.leak_factor * leak_coefficient(
            self.displacement,
            kept if self.compressed is None else kept + self.compressed,
            self.nominal_speed,
            self.nominal_pressure,
            self.nominal_viscosity,
            self.nominal_density,
            viscosity,
            density,
        )

    def leakage(self, speed: Real, pressure_rise: Real, viscosity: Real, density: Real) -> Real:
        """Leakage from outlet to inlet [m3/s]: eq. 9 or the table, and the orifice's share.

        Args:
            speed: of the pump [rad/s].
            pressure_rise: [Pa].
            viscosity: in the gaps [m2/s].
            density: [kg/m3].
        """
        if self.table is None:
            leak = self.leak_coefficient(viscosity, density) * pressure_rise
        else:
            leak = self.leak_factor * self.table.leakage(self.displacement, speed, pressure_rise, viscosity)
        if self.orifice_leak is not None:
            leak = leak + orifice_flow(self.orifice_leak, pressure_rise)
        return leak

    def flow(self, speed: Real, pressure_rise: Real, viscosity: Real, density: Real) -> Real:
        """Volume flow from inlet to outlet [m3/s], eqs 3 and 9, at a pump speed [rad/s] and pressure rise [Pa].

        Of oil that keeps its volume; else `flows` has what is drawn and what is delivered.
        """
        return self.displacement * speed - self.leakage(speed, pressure_rise, viscosity, density)

    def flows(self, speed: Real, leakage: Real, volumes: tuple[Real, Real]) -> tuple[Real, Real]:
        """Volume flows that leave the inlet and that come to the outlet [m3/s]; their masses are the same.

        Its chambers fill on the side that it draws from, with that side's density. What leaks has the density of the
        side with the higher pressure, where efficiencies are measured.

        Args:
            speed: of the pump [rad/s].
            leakage: [m3/s].
        """
        if self.compressed is None:
            flow = self.displacement * speed - leakage
            return flow, flow
        at_inlet, at_outlet = volumes
        filled = ca.if_else(speed > 0.0, at_inlet, at_outlet)
        mass = self.displacement * speed / filled - leakage / ca.fmin(at_inlet, at_outlet)
        return mass * at_inlet, mass * at_outlet

    def torque(self, speed: Real, pressure_rise: Real, viscosity: Real | None = None) -> Real:
        """Torque at the pump's own shaft [N m], eqs 4, 7 and 8; arguments as `friction`."""
        return self.displacement * pressure_rise + self.friction(speed, pressure_rise, viscosity)

    def friction(self, speed: Real, pressure_rise: Real, viscosity: Real | None = None) -> Real:
        """Friction torque at the pump's own shaft [N m], eq. 7 or the table.

        Args:
            speed: of the pump [rad/s].
            pressure_rise: [Pa].
            viscosity: [m2/s]; a table and the drag ask for it.

        Source: Coulomb, viscous and hydrodynamic terms beside a constant one, as W. M. J. Schlösser, Hydraulic Power
        Transmission 7 (1961), and W. E. Wilson, Trans. ASME 68 (1946) 115, have them.
        """
        friction: Real
        if self.table is not None:
            assert viscosity is not None, "a table of losses needs the viscosity"
            friction = self.table.friction(
                self.displacement, speed, pressure_rise, viscosity, threshold=self.threshold_speed
            )
        else:
            coefficient = friction_coefficient(self.displacement, self.hydromechanical_efficiency)
            friction = friction_torque(self.no_load_torque, coefficient, pressure_rise, speed, self.threshold_speed)
            if self.drag is not None:
                assert viscosity is not None, "drag needs the viscosity"
                friction = friction + self.drag * speed * viscosity / self.nominal_viscosity
            if self.hydrodynamic_drag is not None:
                friction = friction + self.hydrodynamic_drag * speed * ca.fabs(speed)
        return friction if self.friction_factor is None else self.friction_factor * friction

    def filled(
        self, speed: Real, inlet: Real, outlet: Real, kept: Callable[[Scalar], Scalar] = lambda value: value
    ) -> Real:
        """Share of its chambers that fills with oil [1]: the way in passes K sqrt(p), what turns asks for D|w|.

        Below 0 bar nothing more comes in; the oil's vapour pressure, less than a millibar, is taken for that. Slower
        than the speed at which friction is fully developed chambers fill in any case.

        Args:
            speed: of the pump, of one that swivels times its share [rad/s].
            inlet: absolute pressure [Pa]; it draws from there where the speed is positive.
            outlet: the same, from where it draws where the speed is negative [Pa].
            kept: makes coefficients of expressions, as `Circuit.coefficient` does.

        Source: a pump's makers give the inlet pressure at which it fills at its highest speed; between suction port and
        chamber the loss of pressure goes with the speed squared (E. C. Fitch and I. T. Hong, Hydraulic System Design
        for Service Assurance, 2004). Air that comes out of solution before that is not in it.

        Example:
            >>> from dataclasses import replace
            >>> from ramsight import machine
            >>> from ramsight.plant.build import build
            >>> pump = build(machine.load_machine("mining-loader").unit("boom"), "boom").a.pump
            >>> starving = replace(pump, filling=pump.displacement * 300.0 / 0.8e5**0.5)
            >>> [round(float(starving.filled(300.0, p, 100e5)), 2) for p in (0.2e5, 0.8e5, 4e5)]
            [0.5, 1.0, 1.0]
        """
        if self.filling is None:
            return 1.0
        side = ca.if_else(speed > 0.0, inlet, outlet)
        turns = ca.fmax(ca.fabs(speed), self.threshold_speed)
        # The way in chokes like a valve that opens: in a balance its flow follows the pressure within an iteration,
        # whether it chokes is evaluated again in the next.
        slope = kept(orifice_slope(self.filling, side) / (self.displacement * turns))
        chokes = kept(ca.if_else(slope * side < 1.0, 1.0, 0.0))
        return 1.0 - chokes * (1.0 - ca.fmax(slope * side, self.threshold_speed / turns))

    def connect(self, circuit: Circuit) -> None:
        """Add flow, torque and losses."""
        speed: Real = self.belt * circuit.motor_speed
        inlet, outlet = circuit.pressure(self.inlet), circuit.pressure(self.outlet)
        rise = outlet - inlet
        viscosity: Real = circuit.viscosity
        if circuit.oil.pressure_viscosity is not None:
            viscosity = viscosity * circuit.oil.thickening(0.5 * (inlet + outlet))
        leak = self.leakage(speed, rise, viscosity, circuit.density)
        friction = self.friction(speed, rise, circuit.viscosity)
        swivel = self.swivel(circuit)
        displacement = self.displacement * swivel
        if self.filling is not None:
            filled = self.filled(speed * swivel, inlet, outlet, circuit.coefficient)
            displacement = displacement * filled
            circuit.output(f"{self.name}.filled", "1", filled)
        shares = circuit.oil_share(self.inlet), circuit.oil_share(self.outlet)
        if not all(isinstance(share, float) for share in shares):
            displacement = displacement * ca.if_else(speed > 0.0, *shares)
        if self.belt_loss is None and self.belt_creep is None:
            circuit.shaft_torque(self.belt * (displacement * rise + friction))
        else:
            torque = displacement * rise + friction
            lost, driven = self.belt_torque(speed, torque), self.driven_speed(speed, torque)
            circuit.shaft_torque(self.belt * (torque + lost))
            circuit.loss(f"{self.name}.belt", lost * speed + torque * (speed - driven))
            speed = driven
        if self.compressed is None:
            circuit.flow(self.name, self.inlet, self.outlet, displacement * speed - leak)
        else:
            volumes = circuit.oil.specific_volume(inlet), circuit.oil.specific_volume(outlet)
            swivelled = replace(self, displacement=displacement)  # type: ignore[arg-type]  # a graph for a number
            drawn, delivered = swivelled.flows(speed, leak, volumes)
            circuit.flow(self.name, self.inlet, self.outlet, drawn, arriving=delivered)
            useful = displacement * speed * rise - leak * rise
            circuit.work(f"{self.name}.compression", useful - (delivered * outlet - drawn * inlet))
        circuit.loss(f"{self.name}.leakage", leak * rise)
        circuit.loss(f"{self.name}.friction", friction * speed)

    def swivel(self, circuit: Circuit) -> Real:
        """Share of its displacement that it moves per revolution [1]; a pump of fixed displacement moves all of it."""
        del circuit
        return 1.0

    def shaft_torque(self, speed: Real, pressure_rise: Real, viscosity: Real | None = None) -> Real:
        """Torque at the motor's shaft [N m], the belt's loss in it; arguments as `friction`."""
        torque = self.torque(speed, pressure_rise, viscosity)
        return self.belt * (torque if self.belt_loss is None else torque + self.belt_torque(speed, torque))

    def belt_torque(self, speed: Real, torque: Real) -> Real:
        """Torque that the belt loses, at the pump's shaft and against its rotation [N m].

        Args:
            speed: of the pump by the belt's ratio [rad/s].
            torque: of the pump [N m]; positive where the motor drives it forwards.
        """
        if self.belt_loss is None:
            return 0.0
        return self.belt_loss * ca.fabs(torque) * ca.tanh(4.0 * speed / self.threshold_speed)

    def driven_speed(self, speed: Real, torque: Real) -> Real:
        """Speed of the pump behind the belt [rad/s]: it lags where the motor drives, and leads where the load does.

        A belt is longer where it pulls, so less runs onto the driven pulley than off the driving one (elastic creep),
        in proportion to the torque.

        Args:
            speed: by the belt's ratio [rad/s].
            torque: of the pump [N m].
        """
        if self.belt_creep is None:
            return speed
        return speed - self.belt_creep * ca.fabs(speed) * torque / (self.displacement * self.nominal_pressure)
