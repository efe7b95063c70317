"""The power of a drive's DC link against its torque and speed, with gain and losses that are learned.

    power - torque speed - P0 = g torque speed + (1 + c) copper loss + (1 + i) iron loss,

a Kalman filter of three states that learns nothing while anything seems wrong. A torque that is off in its gain has
that twice in the copper's loss and not at all in the iron's, so these two have factors of their own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Real, Scalar, all_of, scalar
from ramsight.machine.assumption_description import AssumedPower
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.checks.diagnosis import DiagnosisState, Pair
from ramsight.sensor.checks.disagreement import Disagreement, OnsetState, Sums, compared, leaky_sum
from ramsight.sensor.covariance import Covariance
from ramsight.sensor.inputs.sample import DC_POWER, Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import (
    FRICTION_TORQUE_SHARE,
    HALF,
    LIMIT_SHARE,
    MEASURABLE_LIMIT,
    MEMORY_TIME,
    MIXED_FRICTION_SPEED,
    SHORTEST_STEP,
    TURNED_LEAST,
)

GAIN, COPPER, IRON = "gain", "copper", "iron"


@dataclass(frozen=True, kw_only=True)
class PowerState:
    """Power, torque and speed."""

    last: Scalar = leaf("W")  # power at the last sample that had one [W]
    begun: Flag = leaf("1")  # whether the last sample had one
    turned: Scalar = leaf("rad")  # angle of the shaft lately [rad]
    by_reported: Sums = field(default_factory=Sums)  # difference at the reported speed
    by_counter: Sums | None = None  # difference at the counter's speed, where there is one
    off: Mapping[str, Scalar] = leaf("1", None)  # gain and losses over the declared ones, less 1, as learned
    covariance: Covariance  # of these
    # torque_onset: growth of the position's standard deviation by a torque that is contradicted
    torque_onset: OnsetState = field(default_factory=OnsetState)
    diagnosis: DiagnosisState = field(default_factory=DiagnosisState)  # of the torque

    @classmethod
    def initial(cls, assumptions: Assumptions, *, with_counter: bool) -> PowerState:
        """Before the first sample."""
        return cls(
            by_counter=Sums() if with_counter else None,
            off={one: scalar(0.0) for one in (GAIN, COPPER, IRON)},
            covariance=Covariance.diagonal(_declared(assumptions.power)),
        )


def _declared(power: AssumedPower) -> dict[str, float]:
    """Declared standard deviations of gain and losses [1]."""
    return {GAIN: power.gain, COPPER: power.losses, IRON: power.losses}


@dataclass(frozen=True)
class PowerReading:
    """The power at a sample, means over the sample as the speed is."""

    state: PowerState  # before it
    sample: Sample  # with the reported speed
    model: MachineModel  # of the machine
    reported: Scalar  # power at the sample [W]
    there: Flag  # whether it can be compared
    power: Scalar  # mean [W]
    torque: Scalar  # mean [N m]
    turned: Scalar  # angle of the shaft lately [rad]

    @classmethod
    def of(cls, state: PowerState, sample: Sample, model: MachineModel) -> PowerReading:
        """The power at a sample of a machine that declares it."""
        reported = sample.measured[DC_POWER]
        there = all_of(all_of(ca.fabs(reported) < MEASURABLE_LIMIT, state.begun), sample.elapsed > 0.0)
        return cls(
            state=state,
            sample=sample,
            model=model,
            reported=reported,
            there=there,
            power=ca.if_else(there, 0.5 * (reported + state.last), 0.0),
            torque=0.5 * (sample.motor_torque + sample.last_torque),
            turned=leaky_sum(state.turned, ca.fabs(sample.mean_speed), sample.elapsed),
        )

    @property
    def _rated(self) -> Scalar:
        return self.model.relief_torque * self.model.max_speed

    def _row(self, speed: Scalar) -> dict[str, Scalar]:
        """What goes through the shaft, and losses with torque and with speed, as declared [W]."""
        return {GAIN: self.torque * speed, COPPER: self._copper_loss(self.torque), IRON: self._iron_loss(speed)}

    def _copper_loss(self, torque: Real) -> Scalar:
        return self.model.assumed.power.copper * (torque / self.model.relief_torque) ** 2 * self._rated

    def _iron_loss(self, speed: Scalar) -> Scalar:
        return self.model.assumed.power.iron * ca.fabs(speed) / self.model.max_speed * self._rated

    def _unknown(self, speed: Scalar, covariance: Covariance) -> Scalar:
        """Variance of that by the uncertainty of gain and losses [W2]."""
        return ca.fmax(covariance.variance(self._row(speed)), 0.0)

    def _missing(self, speed: Scalar) -> Scalar:
        """Power that torque, speed and the learned gain and losses leave unexplained [W]."""
        known = sum((1.0 + self.state.off[name]) * by for name, by in self._row(speed).items())
        return ca.if_else(self.there, self.power - (known + self.model.assumed.power.standby), 0.0)

    def _noise(self, speed: Scalar) -> Scalar:
        """Standard deviation of that by what is new with each sample [W]."""
        power = self.model.assumed.power.std * self._rated
        return ca.sqrt(power**2 + (self.model.torque_std * speed) ** 2)

    def against(self, sums: Sums, speed: Scalar, level: Scalar) -> tuple[Sums, Disagreement]:
        """The power against the torque at a speed [rad/s]; `level` is that speed at the sample."""
        assumed = self.model.assumed
        standby = assumed.power.losses * assumed.power.standby
        return compared(
            sums,
            self.sample,
            self._missing(speed),
            level=self.sample.motor_torque * level,
            delay=assumed.drive.delay,
            lasting=ca.sqrt(self._unknown(speed, self.state.covariance) + standby**2),
            noise=self._noise(speed),
        )

    def pair(self, speed: Scalar, covariance: Covariance) -> Pair:
        """The reported torque and the one that the power asks for at a speed [N m].

        Args:
            speed: of the shaft [rad/s].
        """
        turning, assumed = ca.fmax(ca.fabs(speed), MIXED_FRICTION_SPEED), self.model.assumed
        return Pair(
            name="torque",
            unit="N m",
            reported=self.torque,
            other=self._asked(speed, turning),
            std=ca.sqrt(self._noise(speed) ** 2 + self._unknown(speed, covariance)) / turning,
            delay=assumed.drive.delay,
            there=all_of(self.there, ca.fabs(speed) > MIXED_FRICTION_SPEED),
            most=LIMIT_SHARE * self.model.relief_torque,
            least=FRICTION_TORQUE_SHARE * self.model.relief_torque,
            gain=max(assumed.drive.torque_gain, assumed.power.gain),
        )

    def _asked(self, speed: Scalar, turning: Scalar) -> Scalar:
        """The torque T of which the power is (1 + g) T w + (1 + c) k T^2 + (1 + i) iron loss + P0 [N m]."""
        off = self.state.off
        through = self.power - (1.0 + off[IRON]) * self._iron_loss(turning) - self.model.assumed.power.standby
        by_speed, by_square = (1.0 + off[GAIN]) * turning, (1.0 + off[COPPER]) * self._copper_loss(1.0)
        root = ca.sqrt(ca.fmax(by_speed**2 + 4.0 * by_square * through, 0.0))
        return ca.if_else(speed < 0.0, -2.0, 2.0) * through / (by_speed + root)

    def learned(self, speed: Scalar, found: Disagreement) -> tuple[dict[str, Scalar], Covariance]:
        """Gain and losses with their covariance, taught by a difference that is usual.

        Args:
            speed: of the shaft [rad/s].
        """
        dt, drive = self.sample.elapsed, self.model.assumed.drive
        h = ca.fmax(dt, SHORTEST_STEP)
        usual = ca.fabs(found.by) < HALF * found.allowed
        use = all_of(all_of(self.there, usual), ca.fabs(speed) > MIXED_FRICTION_SPEED)
        # What delays make of a changing level lasts as long as the change, noise as long as filters do.
        filtered = self._noise(speed) ** 2 * ca.fmax(1.0, 2.0 * drive.delay / h)
        variance = filtered + (found.late / MEMORY_TIME) ** 2 * ca.fmax(1.0, MEMORY_TIME / h)
        covariance, changes = self.state.covariance.updated(self._row(speed), self._missing(speed), variance, use)
        power = self.model.assumed.power
        for name, std in _declared(power).items():
            covariance = covariance.added(name, (power.walk * std / power.gain) ** 2 * dt)
            # A machine that has cooled down is known as well as a new one, and no less.
            covariance = covariance.limited(std, name)
        return {name: self.state.off[name] + change for name, change in changes.items()}, covariance.closed()

    def signed(self, by: Scalar) -> Scalar:
        """Torque that the power asks for beyond the reported one, over the last second [N m]."""
        return ca.if_else(self.turned > TURNED_LEAST, by / ca.fmax(self.turned, TURNED_LEAST), 0.0)

    def torque_off(self, by: Scalar) -> Scalar:
        """Its size, no more than the torque at relief pressure [N m]."""
        return ca.fmin(ca.fabs(by) / ca.fmax(self.turned, TURNED_LEAST), self.model.relief_torque)
