"""What a drive reports of a run, in steps and with noise: speed, torque, temperature, and no truth."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.lagging import Value, lagging, stepped
from ramsight.duty.reading_report import LinkReport, ReadingReport, declared_link, declared_readings
from ramsight.logs import channels
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import TIME, Dataset, Signal, Signals
from ramsight.units import FREEZING, RPM

_PRESSURES, SPEEDS = 0x70726573, 0x73706565  # apart from the drive's noise of the same seed


@dataclass(frozen=True)
class Magnets:
    """Permanent magnets that warm up: the torque of a current falls, and a drive that does not know reports too much.

    Their warmth follows the losses in the windings, which go with the torque squared, d theta/dt = (rise (tau/tau_0)^2
    - theta)/T, and the torque constant is k_0 (1 + c theta). What is reported is the current times k_0.

    Source: reversible temperature coefficients of the remanence as magnet makers' data sheets give them.

    Example:
        >>> warm = Magnets(torque=40.0).warmth(np.array([0.0, 1800.0, 1e6]), np.array([40.0, 40.0, 40.0]))
        >>> [round(float(kelvin), 1) for kelvin in warm]
        [0.0, 37.9, 60.0]
    """

    torque: float  # tau_0, at which `rise` is reached in the end [N m]
    rise: float = 60.0  # of the magnets over the temperature for which the drive knows its torque constant [K]
    time_constant: float = 1800.0  # T, of motors of some kW 20 to 60 min [s]
    coefficient: float = -1.1e-3  # c [1/K]; of neodymium magnets -0.09 to -0.12 %/K, of ferrite -0.2 %/K
    first: float = 0.0  # warmth at the beginning [K]

    def warmth(self, time: Array, torque: Array) -> Array:
        """Warmth [K] at times [s] under the torques since the times before [N m], shape (times,)."""
        warmth = np.empty(len(time))
        now = self.first
        for k in range(len(time)):
            if k:
                aim = self.rise * (0.5 * (torque[k - 1] + torque[k]) / self.torque) ** 2
                now = aim + (now - aim) * math.exp(-(time[k] - time[k - 1]) / self.time_constant)
            warmth[k] = now
        return warmth

    def gain(self, time: Array, torque: Array) -> Array:
        """Reported torque over the true one [1]; arguments as `warmth`."""
        return np.asarray(1.0 / (1.0 + self.coefficient * self.warmth(time, torque)))


@dataclass(frozen=True)
class DriveReport:
    """How a drive rounds, how noisy it is, and by how much it is off."""

    speed_step: float = RPM  # [rad/s]; default 1 rpm
    # speed_noise: standard deviation before it is rounded [rad/s]; none by default, whole rpm of a filtered speed
    speed_noise: float = 0.0
    torque_step: float = 1.0 / 16.0  # [N m]; default 1/16 N m
    torque_noise: float = 0.5  # standard deviation [N m]
    temperature_step: float = 0.1  # [K]
    temperature_noise: float = 0.2  # standard deviation [K]
    torque_gain: float = 1.0  # reported torque over the true one [1]
    temperature_offset: float = 0.0  # reported temperature less the true one [K]
    link: LinkReport | None = None  # how a sensor of the moved body's angle is; None where there is none
    shaft: ShaftReport | None = None  # the counter of its shaft's position; None where it reports none
    power: PowerReport | None = None  # of its DC link; None where it reports none
    # pressure_noise: standard deviation of sensors of the chambers' pressures [Pa]; None where there are none
    pressure_noise: float | None = None
    pressure_lag: float = 0.0  # of those sensors [s]
    magnets: Magnets | None = None  # of the motor, if their warming up changes its torque constant
    # warm_at: temperature of the motor at which the drive knows its torque constant, above which magnets are warmer
    # [K]; None where it reports no temperature
    warm_at: float | None = None
    # readings: occasional sensors of the position, by their channels
    readings: Mapping[channels.Further, ReadingReport] = field(default_factory=dict)
    seed: int = 0  # of the noise; the same seed gives the same log

    def of(self, speed: Array, torque: Array, temperature: Array) -> tuple[Array, Array, Array]:
        """Reported motor speed [rad/s], torque [N m] and oil temperature [K] of true ones, each (samples,)."""
        noise = np.random.default_rng(self.seed).standard_normal((2, len(torque)))
        if self.speed_noise > 0.0:
            own = np.random.default_rng([self.seed, SPEEDS])
            speed = speed + self.speed_noise * own.standard_normal(len(speed))
        return self.sample(speed, torque, temperature, (noise[0], noise[1]))

    def sample(
        self, speed: Value, torque: Value, temperature: Value, noise: tuple[Value, Value]
    ) -> tuple[Value, Value, Value]:
        """The same of one sample or of many, with noise of torque and temperature of standard deviation 1."""
        torque = self.torque_gain * torque + self.torque_noise * noise[0]
        temperature = temperature + self.temperature_offset + self.temperature_noise * noise[1]
        return (
            stepped(speed, self.speed_step),
            stepped(torque, self.torque_step),
            stepped(temperature - FREEZING, self.temperature_step) + FREEZING,
        )


def usual_report(unit: HydraulicUnit) -> DriveReport:
    """That of a usual CANopen drive, its torque no noisier and in no larger steps than the unit declares.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> axis = build(machine.load_machine("eha-test-bench").unit("axis"), "axis")
        >>> round(usual_report(axis).torque_noise, 3)
        0.106
    """
    usual, declared = DriveReport(), unit.assumptions.drive.torque * limits_of(unit).torque
    share = min(declared / usual.torque_noise, 1.0)
    return replace(usual, torque_noise=share * usual.torque_noise, torque_step=share * usual.torque_step)


def declared_report(unit: HydraulicUnit, seed: int, like: DriveReport | None = None) -> DriveReport:
    """What a drive reports with all that a unit declares.

    Args:
        unit: the unit; what its sensors are off by is drawn from what it declares.
        seed: of that, and of all noise.
        like: the rest; by default that of a usual drive of the unit's size.
    """
    sensors = unit.assumptions.pressure
    return replace(
        like or usual_report(unit),
        link=declared_link(unit, seed),
        shaft=declared_shaft(unit),
        power=declared_power(unit, seed),
        pressure_noise=sensors.std if sensors.std > 0.0 else None,
        pressure_lag=sensors.lag,
        warm_at=unit.assumptions.motor_temperature.reference if unit.assumptions.motor_temperature.std > 0.0 else None,
        readings=declared_readings(unit, seed),
        seed=seed,
    )


def report(run: Dataset, how: DriveReport | None = None) -> Dataset:
    """The drive log of a simulated run, as Datasets; arguments as `reported`."""
    return reported(Signals.of(run), how).dataset().copy(deep=True)  # its values are its own


def reported(run: Signals, how: DriveReport | None = None) -> Signals:
    """The drive log of a simulated run.

    Args:
        run: what `simulate` returns, as columns.
        how: rounding and noise; by default that of a usual CANopen drive.

    Returns:
        Columns over the same `time` with motor_speed, motor_torque and oil_temperature, the commands to the
        circuit's parts, and whatever of `FURTHER` there is.
    """
    how = how or DriveReport()
    names = ("motor_speed", "motor_torque", "oil_temperature")
    speed, torque, temperature = (run[name].values for name in names)
    if how.magnets is not None:
        torque = how.magnets.gain(run["time"].values, torque) * torque
    kept = (TIME, *names, *(name for name in run.names if channels.is_command(name)))
    log = Signals({name: run[name] for name in kept}).replaced(
        dict(zip(names, how.of(speed, torque, temperature), strict=True))
    )
    further = {
        channel.name: Signal(values, {"units": channel.units, "long_name": channel.long_name})
        for channel, values in further_report(how, lambda name: run[name].values).items()
    }
    return Signals({**log.columns, **further}, {"format": 1, "kind": channels.DRIVE_LOG})


def further_report(how: DriveReport, true: Callable[[str], Array]) -> dict[channels.Channel, Array]:
    """What is reported beside speed, torque and temperature.

    Args:
        true: signals as they are, by their names in runs, each (samples,): `time` [s], `motor_speed` [rad/s],
            `motor_torque` [N m], `position` [m], `pressure_a` and `pressure_b` [Pa]; called for those that are needed.
    """
    found: dict[channels.Channel, Array] = {}
    if how.link is not None:
        found[channels.LINK_ANGLE] = how.link.reported(true("time"), true("position"))
    if how.shaft is not None:
        found[channels.SHAFT_ANGLE] = how.shaft.reported(true("time"), true("motor_speed"))
    if how.power is not None:
        found[channels.DC_POWER] = how.power.reported(true("motor_speed"), true("motor_torque"))
    if how.warm_at is not None:
        warmer = 0.0 if how.magnets is None else how.magnets.warmth(true("time"), true("motor_torque"))
        found[channels.MOTOR_TEMPERATURE] = np.round(how.warm_at + warmer + np.zeros(len(true("time"))))
    if how.pressure_noise is not None:
        time = true("time")
        for k, channel in enumerate((channels.PRESSURE_A, channels.PRESSURE_B)):
            noise = np.random.default_rng([how.seed, k, _PRESSURES]).standard_normal(len(time))
            shown = lagging(time, true(channel.name), how.pressure_lag)
            found[channel] = shown + how.pressure_noise * noise
    for reading, sensor in how.readings.items():
        found[reading] = sensor.reported(true("time"), true("position"))
    return found


_OTHER = 0x64637670  # apart from the drive's noise of the same seed


_POWER = 0x706F7772  # apart from the noise of the torque of the same seed


@dataclass(frozen=True)
class ShaftReport:
    """The counter of a shaft's position."""

    step: float = 2.0 * math.pi / 4096  # of the counter [rad]; 4096 increments a turn by default
    first: float = 0.0  # what it shows at the beginning [rad]

    def reported(self, time: Array, speed: Array) -> Array:
        """Angles [rad] at times [s], of speeds [rad/s], shape (samples,).

        Between samples the speed is taken to be linear, as the duties of a simulation are.

        Example:
            >>> ShaftReport(step=0.0).reported(np.array([0.0, 0.5, 1.0]), np.array([0.0, 2.0, 2.0])).tolist()
            [0.0, 0.5, 1.5]
        """
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
        angle = self.first + turned
        return stepped(angle, self.step)


@dataclass(frozen=True)
class PowerReport:
    """Power that a drive takes from its DC link.

    P = torque speed + P0 + c torque^2 + s abs(speed)
    """

    standby: float = 50.0  # P0 [W]
    copper: float = 0.0  # c [W/(N m)2]
    iron: float = 0.0  # s [W s/rad]
    gain: float = 1.0  # of the reading [1]
    noise: float = 0.0  # standard deviation [W]
    step: float = 1.0  # [W]
    seed: int = 0  # of the noise; the same seed gives the same power

    def reported(self, speed: Array, torque: Array) -> Array:
        """Power [W] of true speeds [rad/s] and torques [N m], shape (samples,).

        Example:
            >>> PowerReport(standby=50.0, copper=0.1, iron=0.2).reported(np.array([100.0]), np.array([20.0])).tolist()
            [2110.0]
        """
        noise = np.random.default_rng([self.seed, _POWER]).standard_normal(len(speed))
        return self.sample(speed, torque, noise)

    def sample(self, speed: Value, torque: Value, noise: Value) -> Value:
        """Power [W] of a true speed [rad/s] and torque [N m], with noise of standard deviation 1, or of many."""
        power = torque * speed + self.standby + self.copper * torque**2 + self.iron * abs(speed)
        return stepped(self.gain * power + self.noise * noise, self.step)


def declared_shaft(unit: HydraulicUnit) -> ShaftReport | None:
    """The counter that a unit declares; None if it declares none."""
    std = unit.assumptions.shaft.std
    return ShaftReport(step=math.sqrt(12.0) * std) if std > 0.0 else None


def declared_power(unit: HydraulicUnit, seed: int) -> PowerReport | None:
    """The power that a unit declares, gain and losses drawn from what is declared; None if it declares none.

    Args:
        seed: of gain, losses and noise; the same seed gives the same drive.
    """
    assumed = unit.assumptions.power
    if assumed.std == 0.0:
        return None
    random, limits = np.random.default_rng([seed, _OTHER]), limits_of(unit)
    losses = max(0.0, 1.0 + assumed.losses * float(random.standard_normal()))
    return PowerReport(
        standby=losses * assumed.standby,
        copper=losses * assumed.copper * limits.max_speed / limits.torque,
        iron=losses * assumed.iron * limits.torque,
        gain=1.0 + assumed.gain * float(random.standard_normal()),
        noise=assumed.std * limits.torque * limits.max_speed,
        seed=seed,
    )
