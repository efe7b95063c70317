"""The electric drive that turns the pumps: a speed that is simply there, or a servo that has to reach it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca

from ramsight.expression import Real

if TYPE_CHECKING:
    from ramsight.plant.circuit import Circuit


@dataclass(frozen=True)
class Supply:
    """What feeds the motor, for energy figures only; nothing in the equations depends on it."""

    drive_efficiency: float  # of motor and inverter together, either way [1]
    battery_efficiency: float  # of the battery, each way [1]

    def electrical(self, shaft_given: float, shaft_taken: float) -> tuple[float, float]:
        """Energy drawn from the battery's chemistry and put back into it [J], from what the shaft gave and took [J]."""
        share = self.drive_efficiency * self.battery_efficiency
        return shaft_given / share, shaft_taken * share


@dataclass(frozen=True)
class IdealDrive:
    """A motor that follows its speed command exactly and gives the torque that this takes."""

    name: str
    inertia: float  # of rotor, belt and pumps at the motor shaft [kg m2]
    supply: Supply | None = None

    def connect(self, circuit: Circuit) -> None:
        """Add the rotor's share of the torque and its energy."""
        circuit.shaft_torque(self.inertia * circuit.motor_acceleration)
        circuit.stored("rotor", 0.5 * self.inertia * circuit.motor_speed * circuit.motor_speed)


@dataclass(frozen=True)
class ServoDrive:
    """A motor with inertia whose torque, limited, comes from a PI speed controller.

    T = limit(k_p (w_ref - w) + z), dz/dt = k_i (w_ref - w) + (k_i/k_p)(T - T_unlimited): the integral does not wind
    up while the torque is at its limit (back-calculation, Åström and Hägglund, PID Controllers, section 3.5).
    """

    name: str
    inertia: float  # of rotor, belt and pumps at the motor shaft [kg m2]
    proportional_gain: float  # k_p [N m/(rad/s)]
    integral_gain: float  # k_i [N m/rad]
    max_torque: float  # limit either way [N m]
    supply: Supply | None = None

    def torque(self, error: Real, integral: Real) -> Real:
        """Torque [N m] at a speed error [rad/s] and an integral [N m]."""
        return ca.fmin(ca.fmax(self.proportional_gain * error + integral, -self.max_torque), self.max_torque)

    def connect(self, circuit: Circuit) -> None:
        """Make speed and integral states, and give the torque."""
        reference, speed = circuit.speed_loop()
        integral = circuit.state("motor_torque_integral", "N m", 1e-4)
        error = reference - speed
        torque = self.torque(error, integral)
        excess = torque - (self.proportional_gain * error + integral)
        rate = self.integral_gain * error + self.integral_gain / self.proportional_gain * excess
        circuit.motor(torque)
        circuit.derivative("motor_torque_integral", rate)
        circuit.at_last(lambda: circuit.derivative("motor_speed", (torque - circuit.torque_taken) / self.inertia))
        circuit.stored("rotor", 0.5 * self.inertia * speed * speed)
        circuit.output("motor_speed_command", "rad/s", reference)


Drive = IdealDrive | ServoDrive
