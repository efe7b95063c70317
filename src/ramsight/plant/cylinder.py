"""The cylinder: two chambers, a piston with friction and a mass, end stops, and the load that presses on it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca

from ramsight.expression import Real
from ramsight.plant.oil import ATMOSPHERE

if TYPE_CHECKING:
    from ramsight.plant.circuit import Circuit


_DEVELOPED = 10.0 * math.sqrt(2.0)  # Stribeck velocities over v_C, where Coulomb friction is developed


def friction_force(velocity: Real, coulomb: Real, breakaway: Real, viscous: Real, stribeck_velocity: Real) -> Real:
    """Friction force [N] against the motion: Stribeck hump, Coulomb and viscous part.

    F = sqrt(2e) (F_brk - F_C) exp(-(v/v_st)^2) v/v_st + F_C tanh(v/v_C) + f v with v_C = v_st/(10 sqrt(2)).

    Args:
        velocity: [m/s].
        coulomb: F_C [N].
        breakaway: F_brk, the largest friction near rest [N].
        viscous: f [N/(m/s)].
        stribeck_velocity: v_st; friction is largest at v_st/sqrt(2) [m/s].

    Source: Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083, in the smooth form that
    MathWorks documents for its translational friction.
    """
    z = velocity / stribeck_velocity
    stribeck = math.sqrt(2.0 * math.e) * (breakaway - coulomb) * z * ca.exp(-z * z)
    return stribeck + coulomb * ca.tanh(_DEVELOPED * z) + viscous * velocity


def seal_friction(velocity: Real, share: Real, force: Real, stribeck_velocity: Real) -> Real:
    """Friction force [N] of seals that the oil presses on: F = mu |F_p| tanh(v/v_C), beside that of `friction_force`.

    Args:
        velocity: [m/s].
        share: mu, of the force [1]; cylinders pass on 95 to 98 % of what presses on their pistons.
        force: F_p, of the chambers' pressures above the atmosphere's [N].
        stribeck_velocity: v_st, as `friction_force` takes it [m/s].

    Source: hydro-mechanical efficiency of cylinders, H. Murrenhoff, Grundlagen der Fluidtechnik, part 1.

    Example:
        >>> round(float(seal_friction(0.1, 0.03, -2e5, 5e-3)))
        6000
    """
    return share * ca.fabs(force) * ca.tanh(_DEVELOPED * velocity / stribeck_velocity)


def sliding_friction(speed: Real, coulomb: Real, viscous: Real) -> Real:
    """What `friction_force` comes to at speeds far above v_st, F_C + f v [N]: a tenth of a billionth off at 5 v_st.

    Args:
        speed: not negative [m/s].
        coulomb: F_C [N].
        viscous: f [N/(m/s)].
    """
    return coulomb + viscous * speed


@dataclass(frozen=True)
class Cylinder:
    """One cylinder, or several that move together, with the mass they carry."""

    name: str
    # node_a, node_b: nodes of the A-side (piston) and B-side (rod) chamber
    node_a: str
    node_b: str
    # area_a, area_b: piston areas, all cylinders together [m2]
    area_a: float
    area_b: float
    stroke: float  # [m]
    # dead_volume_a, dead_volume_b: chamber volumes at zero stroke of that side [m3]
    dead_volume_a: float
    dead_volume_b: float
    mass: float  # moved mass [kg]
    # coulomb_friction, breakaway_friction: [N]
    coulomb_friction: float
    breakaway_friction: float
    viscous_friction: float  # [N/(m/s)]
    stribeck_velocity: float  # [m/s]
    stop_stiffness: float  # of the end stops [N/m]
    stop_damping: float  # force of the stop grows by this share per speed of approach [s/m]
    load_sign: float  # +1 if a positive load presses the piston in, -1 if it pulls it out
    # leakage past the seals per pressure difference, times viscosity [m3/s/Pa m2/s]; none without it
    seal_leak: float | None = None
    # cushion_length_a, cushion_length_b: of the end cushions at position 0 and at the stroke [m]; none without
    cushion_length_a: float | None = None
    cushion_length_b: float | None = None
    # cushion_area_a, cushion_area_b: of the pistons around their plungers, all cylinders together [m2]
    cushion_area_a: float | None = None
    cushion_area_b: float | None = None
    cushion_conductance: float | None = None  # of their needle valves, all cylinders together [m3/s/sqrt(Pa)]
    passive: bool = False  # whether the load only resists, whichever way the piston moves
    pressure_friction: float | None = None  # friction over the force of the chambers' pressures [1]; none without it

    def area(self, side: str) -> float:
        """Piston area on side "a" or "b", all cylinders together [m2]."""
        return self.area_a if side == "a" else self.area_b

    def dead_volume(self, side: str) -> float:
        """Chamber volume at zero stroke of side "a" or "b" [m3]."""
        return self.dead_volume_a if side == "a" else self.dead_volume_b

    def friction(self, velocity: Real, force: Real = 0.0) -> Real:
        """Friction force [N] at a velocity [m/s], and a force of the chambers' pressures [N] where it grows with it."""
        friction = friction_force(
            velocity, self.coulomb_friction, self.breakaway_friction, self.viscous_friction, self.stribeck_velocity
        )
        if self.pressure_friction is None:
            return friction
        return friction + seal_friction(velocity, self.pressure_friction, force, self.stribeck_velocity)

    def sliding_friction(self, speed: Real, force: Real = 0.0) -> Real:
        """Friction force [N] at a speed [m/s] far above the Stribeck velocity; `force` as `friction` takes it."""
        friction = sliding_friction(speed, self.coulomb_friction, self.viscous_friction)
        return friction if self.pressure_friction is None else friction + self.pressure_friction * ca.fabs(force)

    def connect(self, circuit: Circuit) -> None:
        """Add the chambers, and a mass that moves with the rods under the load."""
        x = circuit.state("position", "m", 1e-11)
        v = circuit.state("velocity", "m/s", 1e-8)
        load = circuit.load * (ca.tanh(_DEVELOPED * v / self.stribeck_velocity) if self.passive else self.load_sign)
        circuit.derivative("position", v)
        circuit.derivative("velocity", (self.push(circuit, x, v) - load) / self.mass)
        circuit.work("load", load * v)
        circuit.stored("kinetic", 0.5 * self.mass * v * v)

    def push(self, circuit: Circuit, position: Real, velocity: Real) -> Real:
        """Add chambers, friction and end stops, whatever it is that the rods move.

        Args:
            position: of the rods [m].
            velocity: [m/s].

        Returns:
            The force that the rods give [N]; positive extends.
        """
        x, v = position, velocity
        p_a, p_b = circuit.pressure(self.node_a), circuit.pressure(self.node_b)
        circuit.volume(self.node_a, self.dead_volume_a + self.area_a * x, rate=self.area_a * v)
        circuit.volume(self.node_b, self.dead_volume_b + self.area_b * (self.stroke - x), rate=-self.area_b * v)
        ambient = ATMOSPHERE * (self.area_a - self.area_b)
        pressed = self.area_a * p_a - self.area_b * p_b - ambient
        friction = self.friction(v, pressed)
        depth_out, depth_in = ca.fmax(x - self.stroke, 0.0), ca.fmax(-x, 0.0)
        stop = self.stop_stiffness * (depth_in - depth_out)
        damping = self.stop_stiffness * self.stop_damping * (depth_in + depth_out) * v
        circuit.loss(f"{self.name}.friction", friction * v)
        circuit.loss(f"{self.name}.stop", damping * v)
        circuit.work("atmosphere", ambient * v)
        circuit.stored("stop", 0.5 * self.stop_stiffness * (depth_in**2 + depth_out**2))
        circuit.output("friction_force", "N", friction)
        if self.seal_leak is not None:
            leak = self.seal_leak / circuit.viscosity * (p_a - p_b)
            circuit.flow(f"{self.name}.seal", self.node_a, self.node_b, leak)
            circuit.loss(f"{self.name}.seal", leak * (p_a - p_b))
        force = pressed - friction + stop - damping
        if self.cushion_conductance is not None:
            cushions = self.cushion(x, v)
            circuit.loss(f"{self.name}.cushion", -cushions * v)
            force = force + cushions
        return force

    def cushion(self, position: Real, velocity: Real) -> Real:
        """Force of the end cushions [N], positive extends, at a position [m] and a velocity [m/s]."""
        force: Real = 0.0
        if self.cushion_length_a is not None:
            assert self.cushion_area_a is not None and self.cushion_conductance is not None  # noqa: PT018
            ends = self.cushion_length_a, self.cushion_area_a, self.cushion_conductance
            force = force + cushion_force(position, -velocity, *ends)
        if self.cushion_length_b is not None:
            assert self.cushion_area_b is not None and self.cushion_conductance is not None  # noqa: PT018
            ends = self.cushion_length_b, self.cushion_area_b, self.cushion_conductance
            force = force - cushion_force(self.stroke - position, velocity, *ends)
        return force


def cushion_force(left: Real, approach: Real, length: Real, area: Real, conductance: Real) -> Real:
    """Force that slows a piston down before its end [N], A (s A v/K)^2 with s = 1 - left/length.

    The way out narrows with the depth s of a tapered plunger, from an open port to the needle valve, with a conductance
    of K/s: the oil under it has the pressure (s Q/K)^2 above the chamber's. On the way back a check valve lets it in.

    Args:
        left: way that is left to the end [m].
        approach: velocity towards the end [m/s].
        length: of the cushion [m].
        area: of the piston around the plunger [m2].
        conductance: K at the end, Q/sqrt(dp) of the needle valve [m3/s/sqrt(Pa)].

    Source: the orifice equation; how the gap narrows is chosen so that the force sets in without a step. The oil's
    compression in the small volume under the plunger is left out.

    Example:
        >>> [round(float(cushion_force(left, 0.05, 0.02, 0.01, 1e-7)) / 1e3) for left in (0.02, 0.01, 0.0)]
        [0, 62, 250]
    """
    depth = ca.fmin(ca.fmax(1.0 - left / length, 0.0), 1.0)
    flow = depth * area * ca.fmax(approach, 0.0)
    return area * (flow / conductance) ** 2
