"""A linked machine from sample to sample, for whoever decides while it runs; and what its drives report meanwhile."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ramsight.duty.drive_report import DriveReport
from ramsight.duty.linked import audited_model
from ramsight.duty.profile import Array, constant
from ramsight.duty.simulate import SAMPLE_PERIOD, check_temperature
from ramsight.engine.outcome import Outcome
from ramsight.engine.run import Segments, integrate, outputs
from ramsight.errors import SimulationError
from ramsight.plant.linked import LinkedMachine, start_state


@dataclass(frozen=True)
class Reported:
    """One sample of a drive.

    Attributes:
        time: [s].
        motor_speed: [rad/s].
        motor_torque: [N m].
        oil_temperature: [K].
    """

    time: float
    motor_speed: float
    motor_torque: float
    oil_temperature: float


@dataclass(frozen=True)
class Instant:
    """The truth about a machine at one time.

    Attributes:
        time: [s].
        position: of each cylinder [m], by unit.
        motor_speed: [rad/s], by unit.
        motor_torque: [N m], by unit.
        tip: of the tool, forward and up [m].
    """

    time: float
    position: Mapping[str, float]
    motor_speed: Mapping[str, float]
    motor_torque: Mapping[str, float]
    tip: tuple[float, float]


class LiveMachine:
    """A machine that waits for the next command after every sample.

    Args:
        machine: units and mechanism, as they really are.
        start_position: of each unit's piston, at rest [m].
        oil_temperature: of each unit [K].
        payload: [kg].
        period: of the samples [s].

    Raises:
        DescriptionError: an oil temperature is out of range, or the mechanism cannot be assembled there.
    """

    def __init__(
        self,
        machine: LinkedMachine,
        start_position: Mapping[str, float],
        oil_temperature: Mapping[str, float],
        payload: float = 0.0,
        period: float = SAMPLE_PERIOD,
    ) -> None:
        self.machine, self.period = machine, period
        self._model = audited_model(machine)
        names = machine.mechanism.cylinders
        self._parameters = self._model.values[None].copy()
        for unit in machine.units:
            check_temperature(unit, constant(oil_temperature[unit.name]))
            place = self._model.ode.parameters.index(f"{unit.name}.oil_temperature")
            self._parameters[0, place] = oil_temperature[unit.name]
        self._state = start_state(machine, self._model, start_position, payload)
        self._inputs = np.array([*(0.0 for _ in names), payload, 0.0, 0.0])
        self._servo = [self._servo_place(name) for name in names]
        self._torque = [f"{name}.motor_torque" for name in names]
        self._samples = 0
        self.now = self._look(np.zeros_like(self._inputs))

    def advance(
        self, motor_speed: Mapping[str, float], payload: float, tip_force: tuple[float, float] = (0.0, 0.0)
    ) -> Instant:
        """Go on to the next sample.

        Args:
            motor_speed: commands that are reached there, evenly [rad/s], by unit.
            payload: there [kg].
            tip_force: there, forward and up [N].

        Returns:
            The truth there.

        Raises:
            SimulationError: the equations cannot be followed so far.
        """
        inputs = np.array([*(motor_speed[name] for name in self.machine.mechanism.cylinders), payload, *tip_force])
        slope = (inputs - self._inputs) / self.period
        segment = self._segment(slope)
        run = integrate(self._model.ode, self._state, segment, segment.end)
        if run.outcome is not Outcome.DONE:
            raise SimulationError(f"{self._model.ode.name}: {run.message}")
        self._state, self._inputs = run.state[-1], inputs
        self._samples += 1
        self.now = self._look(slope)
        return self.now

    def _segment(self, slope: Array) -> Segments:
        ends = np.array([self._samples, self._samples + 1]) * self.period
        return Segments(ends[:1], ends[1:], self._inputs[None], slope[None], self._parameters)

    def _servo_place(self, name: str) -> int | None:
        states = [state.name for state in self._model.ode.states]
        return states.index(f"{name}.motor_speed") if f"{name}.motor_speed" in states else None

    def _look(self, slope: Array) -> Instant:
        """The truth now; the torque is the one just before the next command."""
        names = self.machine.mechanism.cylinders
        segment = self._segment(slope)
        found = outputs(self._model.ode, segment, segment.start, self._state[None])
        speed = [
            self._inputs[k] if place is None else self._state[place] for k, place in enumerate(self._servo)
        ]  # fmt: skip
        return Instant(
            time=self._samples * self.period,
            position={name: float(found[f"{name}.position"][0]) for name in names},
            motor_speed={name: float(value) for name, value in zip(names, speed, strict=True)},
            motor_torque={name: float(found[key][0]) for name, key in zip(names, self._torque, strict=True)},
            tip=(float(found["tip_x"][0]), float(found["tip_z"][0])),
        )


@dataclass
class LiveReport:
    """What a drive reports, sample by sample, with the rounding and the noise of `report`.

    Args:
        how: rounding and noise.
        temperature_offset: by which its thermometer reads too much [K].
        stream: of drives with the same seed, which one; each has noise of its own.
    """

    how: DriveReport = field(default_factory=DriveReport)
    temperature_offset: float = 0.0
    stream: int = 0

    def __post_init__(self) -> None:
        self._random = np.random.default_rng([self.how.seed, self.stream])

    def sample(self, time: float, motor_speed: float, motor_torque: float, oil_temperature: float) -> Reported:
        """Report one sample; all in SI."""
        torque_noise, warmth_noise = self._random.standard_normal(2)
        warmth = oil_temperature - 273.15 + self.temperature_offset + self.how.temperature_noise * warmth_noise
        return Reported(
            time,
            _rounded(motor_speed, self.how.speed_step),
            _rounded(motor_torque + self.how.torque_noise * torque_noise, self.how.torque_step),
            _rounded(warmth, self.how.temperature_step) + 273.15,
        )


def _rounded(value: float, step: float) -> float:
    return round(value / step) * step if step > 0.0 and math.isfinite(value) else value
