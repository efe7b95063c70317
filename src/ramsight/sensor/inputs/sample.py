"""A sample of a drive: as it is reported, and as the stages of a sensor pass it on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Real, Scalar, count, flag, flag_symbol, scalar, scalar_symbol
from ramsight.logs import channels
from ramsight.logs.channels import column_of
from ramsight.plant.circuit import COMMANDED
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.thresholds import LIMIT_SHARE, SHORTEST_STEP

REPORTED = ("time", "motor_speed", "motor_torque", "oil_temperature")
INPUTS = (*REPORTED, "reference", "reference_known")
"""Inputs of a step: what every drive reports, and a position that is known at that sample, if one is."""

PRESSURES = (channels.PRESSURE_A.name, channels.PRESSURE_B.name)
LINK_ANGLE, SHAFT_ANGLE = channels.LINK_ANGLE.name, channels.SHAFT_ANGLE.name
DC_POWER, MOTOR_TEMPERATURE = channels.DC_POWER.name, channels.MOTOR_TEMPERATURE.name
MEASURED = {one.name: (one.units, one.long_name) for one in channels.FURTHER}
"""Further inputs, where a machine declares them; not-a-number where one is missing: unit, and what they are."""
READINGS = {one.name: one.declared for one in channels.READINGS}
"""Those that are occasional readings of the position: the table of assumptions that declares each."""


def declared_inputs(assumptions: Assumptions) -> tuple[str, ...]:
    """The further inputs that a machine declares."""
    return tuple(one.name for one in channels.FURTHER if getattr(assumptions, one.declared).std > 0.0)


@dataclass(frozen=True)
class Raw:
    """A sample as it is reported."""

    time: Scalar  # [s]
    motor_speed: Scalar  # [rad/s]
    motor_torque: Scalar  # [N m]
    oil_temperature: Scalar  # [K]
    reference: Scalar  # a position that is known at this sample [m]
    referenced: Flag  # whether there is one
    commands: Mapping[str, Scalar]  # of the circuit's commanded parts, -1 to 1, by their names
    measured: Mapping[str, Scalar]  # what else is measured, by the names of `MEASURED`

    @classmethod
    def symbols(cls, commands: Sequence[str] = (), measured: Sequence[str] = ()) -> Raw:
        """Its symbols.

        Args:
            measured: what else is measured, of the keys of `MEASURED`.
        """
        time, speed, torque, temperature, reference = (scalar_symbol(name) for name in INPUTS[:-1])
        return cls(
            time=time,
            motor_speed=speed,
            motor_torque=torque,
            oil_temperature=temperature,
            reference=reference,
            referenced=flag_symbol(INPUTS[-1]),
            commands={part: scalar_symbol(column_of(part)) for part in commands},
            measured={name: scalar_symbol(name) for name in measured},
        )

    @property
    def inputs(self) -> list[Scalar]:
        """All symbols in the order of a recursion's inputs."""
        first = [self.time, self.motor_speed, self.motor_torque, self.oil_temperature, self.reference]
        return [*first, count(self.referenced), *self.commands.values(), *self.measured.values()]


@dataclass(frozen=True, kw_only=True)
class CounterState:
    """The shaft's counter when it was last reported."""

    angle: Scalar = leaf("rad", exact=SHAFT_ANGLE)  # of the shaft [rad]
    begun: Flag = leaf("1")  # whether the last sample had one


@dataclass(frozen=True)
class Sample:
    """A sample as the stages pass it on; each hands the next a new one, and none is changed."""

    started: Flag  # whether there was a sample before
    elapsed: Scalar  # since then [s]
    motor_speed: Scalar  # at the sample [rad/s]
    last_speed: Scalar  # at the one before [rad/s]
    mean_speed: Scalar  # between both [rad/s]
    motor_torque: Scalar  # [N m]
    last_torque: Scalar  # at the sample before [N m]
    oil_temperature: Scalar  # as it is used [K]
    reference: Scalar  # a position that is known at this sample [m]
    referenced: Flag  # whether there is one
    commands: Mapping[str, Scalar]  # of the commanded parts, -1 to 1
    way: Scalar  # +1 where positive motor speed extends the piston, -1 where a commanded valve reverses that
    last_way: Scalar  # the same at the sample before
    measured: Mapping[str, Scalar]  # what else is measured
    counter: CounterState | None = None  # the shaft's counter at the sample before, where the machine declares one
    temperature_variance: Real = 0.0  # that the oil's temperature gains since then, where no report shows it [K2]
    pump_warmer: Real = 0.0  # by how much the oil in the pumps' gaps is warmer than the reported one [K]
    offset_variance: Real = 0.0  # of what is left of the torque's zero error, where one is declared [N2 m2]

    @property
    def one_way(self) -> bool:
        """Whether the motor drives one way only, and a commanded valve decides which way that moves the piston."""
        return bool(self.commands)

    @property
    def angle(self) -> Scalar:
        """By which the shaft turned since the sample before [rad]."""
        return self.mean_speed * self.elapsed

    @property
    def pump_temperature(self) -> Scalar:
        """Of the oil in the pumps' gaps [K]."""
        return self.oil_temperature + self.pump_warmer

    @property
    def extending_speed(self) -> Scalar:
        """Motor speed, positive where it extends the piston [rad/s]."""
        return self.way * self.motor_speed

    @property
    def last_extending_speed(self) -> Scalar:
        """The same at the sample before [rad/s]."""
        return self.last_way * self.last_speed

    @property
    def extending_angle(self) -> Scalar:
        """By which the shaft turned, positive where it extends the piston [rad]."""
        return self.way * self.angle

    def with_speed(self, mean_speed: Scalar, motor_speed: Scalar, last_speed: Scalar) -> Sample:
        """The sample with other speeds [rad/s]."""
        return replace(self, mean_speed=mean_speed, motor_speed=motor_speed, last_speed=last_speed)


@dataclass(frozen=True, kw_only=True)
class SampleState:
    """The last sample, for a sensor that uses its inputs as they are."""

    started: Flag = leaf("1")  # whether there was one
    time: Scalar = leaf("s", exact="time")  # of it [s]
    motor_speed: Scalar = leaf("rad/s")  # at it [rad/s]
    commands: Mapping[str, Scalar] = leaf("1", None)  # at it

    @classmethod
    def initial(cls, commands: Sequence[str] = ()) -> SampleState:
        """Before the first sample."""
        return cls(commands=first_commands(commands))


def lasted(duration: Scalar, least: float) -> Flag:
    """Whether something has lasted as long as it must.

    A duration is a sum of periods, each rounded: without the half of the shortest one, the last digit of a time would
    decide where both are the same number of samples.

    Args:
        duration: [s].
        least: that counts [s].
    """
    return duration > least - 0.5 * SHORTEST_STEP


def first_commands(commands: Sequence[str]) -> dict[str, Scalar]:
    """What commanded parts do before the first sample, by their columns' names."""
    return {column_of(part): scalar(COMMANDED) for part in commands}


def plain_sample(state: SampleState, raw: Raw) -> tuple[SampleState, Sample]:
    """A sample without any check, and what is kept of it."""
    elapsed = ca.if_else(state.started, ca.fmax(raw.time - state.time, 0.0), 0.0)
    last_speed = ca.if_else(state.started, state.motor_speed, raw.motor_speed)
    commands = commanded(raw.commands, state.commands)
    sample = Sample(
        started=state.started,
        elapsed=elapsed,
        motor_speed=raw.motor_speed,
        last_speed=last_speed,
        mean_speed=0.5 * (last_speed + raw.motor_speed),
        motor_torque=raw.motor_torque,
        last_torque=raw.motor_torque,
        oil_temperature=raw.oil_temperature,
        reference=raw.reference,
        referenced=raw.referenced,
        commands=commands,
        way=way_of(list(commands.values())),
        last_way=way_of(list(state.commands.values())),
        measured=raw.measured,
    )
    after = SampleState(
        started=flag(True), time=raw.time, motor_speed=raw.motor_speed, commands=kept_commands(commands)
    )
    return after, sample


def commanded(reported: Mapping[str, Scalar], last: Mapping[str, Scalar]) -> dict[str, Scalar]:
    """Commands of a sample, -1 to 1, by part; the last one where there is none."""
    found = {}
    for part, value in reported.items():
        inside = ca.fmin(ca.fmax(value, -1.0), 1.0)
        found[part] = ca.if_else(ca.fabs(value) <= LIMIT_SHARE, inside, last[column_of(part)])
    return found


def kept_commands(commands: Mapping[str, Scalar]) -> dict[str, Scalar]:
    """The same by their columns' names, as the state has them."""
    return {column_of(part): value for part, value in commands.items()}


def way_of(commands: Sequence[Scalar]) -> Scalar:
    """The way in which positive motor speed moves the piston, 1 extends.

    Where a directional valve connects the pump to a chamber, the sign of its command is the sign of the motion.
    """
    way = scalar(1.0)
    for value in commands:
        way = way * ca.if_else(value < 0.0, -1.0, 1.0)
    return way
