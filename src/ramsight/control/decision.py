"""What activities decide by at a sample, and what they ask for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import casadi as ca

from ramsight.control.activity import Event
from ramsight.control.actuation import Actuation
from ramsight.control.orders import Inputs, Reason
from ramsight.control.sensing import Reliance, Sensed
from ramsight.expression import Condition, Flag, Real, Scalar


@dataclass(frozen=True)
class Sample:
    """What activities decide by."""

    by: Actuation  # the cylinder's motor speeds, with what was learned of it by now
    inputs: Inputs  # of the sample
    sensed: Sensed  # the estimate, its position with the travel that is pending
    reliance: Reliance  # what the estimate and the drive allow
    at_limit: Flag  # whether the drive is at its torque limit
    motor_speed: Scalar  # commanded until now [rad/s]
    target: Scalar  # the last one within the stroke [m]
    acceleration: Real  # largest in a move [m/s2]

    @property
    def start_velocity(self) -> Scalar:
        """Velocity with which an activity begins [m/s]: none while the motor stands."""
        return ca.if_else(self.motor_speed == 0.0, 0.0, self.sensed.velocity)


@dataclass(frozen=True)
class Wish:
    """What an activity asks for, if it is the one of the sample."""

    speed: Real  # of the motor [rad/s]; the control keeps it within acceleration and largest speed
    # whether they happen; the first one that does counts
    events: Mapping[Event, Condition] = field(default_factory=dict)
    # reasons to stop, and whether they hold; they come before the events
    failures: Mapping[Reason, Condition] = field(default_factory=dict)
