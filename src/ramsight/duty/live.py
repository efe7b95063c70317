"""A unit or a linked machine from sample to sample, for whoever decides while it runs; and what its drives report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.audit import refuse_dry
from ramsight.duty.drive_report import SPEEDS, DriveReport
from ramsight.duty.linked_duty import audited_model
from ramsight.duty.live_energy import EnergyAccount, LiveEnergy
from ramsight.duty.profile import constant
from ramsight.duty.simulate import SAMPLE_PERIOD, audited_circuit, check_temperature
from ramsight.engine.equation import OdeModel
from ramsight.engine.run import Outcome, Segments, integrate, outputs
from ramsight.errors import SimulationError
from ramsight.plant.circuit import Audited, is_pressure
from ramsight.plant.linked import LinkedMachine, start_state
from ramsight.plant.unit import HydraulicUnit, initial_state


@dataclass(frozen=True)
class Reported:
    """One sample of a drive."""

    time: float  # [s]
    motor_speed: float  # [rad/s]
    motor_torque: float  # [N m]
    oil_temperature: float  # [K]


@dataclass(frozen=True)
class Instant:
    """The truth about a machine at one time."""

    time: float  # [s]
    position: Mapping[str, float]  # of each cylinder [m], by unit
    motor_speed: Mapping[str, float]  # [rad/s], by unit
    motor_torque: Mapping[str, float]  # [N m], by unit


@dataclass(frozen=True)
class LinkedInstant(Instant):
    """The same of a machine with a mechanism."""

    tip: tuple[float, float]  # of the tool, forward and up [m]


class _Stepped:
    """An equation that waits for its inputs after every sample.

    Args:
        parameters: their values, shape (parameters,).
        period: of the samples [s].
    """

    def __init__(self, ode: OdeModel, parameters: Array, state: Array, inputs: Array, period: float) -> None:
        self.ode, self.state, self.inputs, self.period = ode, state, inputs, period
        self._parameters, self._samples, self._slope = parameters[None].copy(), 0, np.zeros_like(inputs)
        self._found: Mapping[str, Array] | None = None  # of this sample, once somebody has asked

    @property
    def time(self) -> float:
        """Time of the newest sample [s]."""
        return self._samples * self.period

    def advance(self, inputs: Array) -> None:
        """Go on to the next sample, where the inputs are these; they get there evenly.

        Raises:
            SimulationError: the equations cannot be followed so far.
        """
        self._slope = (inputs - self.inputs) / self.period
        segment = self._segment()
        run = integrate(self.ode, self.state, segment, segment.end)
        if run.outcome is not Outcome.DONE:
            raise SimulationError(f"{self.ode.name}: {run.message}")
        refuse_dry(self.ode, run.time, run.state)
        self.state, self.inputs = run.state[-1], inputs
        self._samples += 1
        self._found = None

    def found(self) -> Mapping[str, Array]:
        """The outputs now, by name; a torque is the one just before the next command."""
        if self._found is None:
            segment = self._segment()
            self._found = outputs(self.ode, segment, segment.start, self.state[None])
        return self._found

    def inside(self) -> dict[str, float]:
        """States and outputs now, by name, in SI; integrals of the audit are left out."""
        states = zip(self.ode.states, self.state.tolist(), strict=True)
        known = {
            state.name: max(value, 0.0) if is_pressure(state) else value  # below 0 its oil is torn
            for state, value in states
            if not state.integral
        }
        return known | {name: float(values[0]) for name, values in self.found().items()}

    def all_inside(self) -> dict[str, float]:
        """As `inside`, with the integrals of the audit."""
        states = zip((state.name for state in self.ode.states), self.state.tolist(), strict=True)
        return dict(states) | {name: float(values[0]) for name, values in self.found().items()}

    def value(self, parameter: str) -> float:
        """What a parameter is now, in SI."""
        return float(self._parameters[0, self.ode.parameters.index(parameter)])

    def change(self, values: Mapping[str, float]) -> None:
        """Go on with other values of parameters, by name, in SI.

        Raises:
            KeyError: the equation has no such parameter.
        """
        places = {name: k for k, name in enumerate(self.ode.parameters)}
        for name, value in values.items():
            self._parameters[0, places[name]] = value
        self._found = None

    def speed(self, name: str, commanded: float) -> float:
        """A motor's speed [rad/s]: the state of that name, if a servo has one, otherwise what is commanded."""
        states = [state.name for state in self.ode.states]
        return float(self.state[states.index(name)]) if name in states else commanded

    def _segment(self) -> Segments:
        ends = np.array([self._samples, self._samples + 1]) * self.period
        return Segments(ends[:1], ends[1:], self.inputs[None], self._slope[None], self._parameters)


def _of(inside: Mapping[str, float], prefix: str) -> Mapping[str, float]:
    """What one unit's circuit knows, without the unit's name."""
    if not prefix:
        return inside
    return {name.removeprefix(prefix): value for name, value in inside.items() if name.startswith(prefix)}


class _Live:
    """What can be changed of a machine that runs, and looked at in it."""

    def __init__(self) -> None:
        self._accounts: dict[str, LiveEnergy] = {}

    _run: _Stepped
    _circuits: Mapping[str, tuple[str, Audited]]

    def begin_account(self) -> None:
        """Account for the energy from now on, by unit in `accounts`."""
        inside = self._run.all_inside()
        self._accounts = {
            name: LiveEnergy(audited, _of(inside, prefix), self._run.value(f"{prefix}tank.pressure"))
            for name, (prefix, audited) in self._circuits.items()
        }

    @property
    def accounts(self) -> dict[str, EnergyAccount]:
        """Energies since `begin_account`, by unit; empty before."""
        return {name: kept.account for name, kept in self._accounts.items()}

    def _enter(self) -> None:
        if not self._accounts:
            return
        inside = self._run.all_inside()
        for name, kept in self._accounts.items():
            kept.enter(_of(inside, self._circuits[name][0]))

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the equation's parameters, which `change` takes; with several units they begin with its name."""
        return self._run.ode.parameters

    def change(self, values: Mapping[str, float]) -> None:
        """Go on with a machine that has changed: other values of parameters, by name, in SI.

        Raises:
            KeyError: the equation has no such parameter.
        """
        self._run.change(values)

    def inside(self) -> dict[str, float]:
        """Joints, pressures, flows, openings and all else that the equation knows now, by name, in SI."""
        return self._run.inside()


class LiveUnit(_Live):
    """A unit that carries a load by itself, and waits for the next command after every sample.

    Args:
        unit: as it really is.
        start_position: of the piston, at rest [m].
        load: on it [N].
        oil_temperature: [K].
        period: of the samples [s].

    Raises:
        DescriptionError: the oil temperature is out of range.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> live = LiveUnit(build(machine.load_machine("press").unit("ram"), "ram"), 0.1, 50e3)
        >>> live.advance(50.0, 50e3).motor_torque["ram"] > 0.0
        True
    """

    def __init__(
        self,
        unit: HydraulicUnit,
        start_position: float,
        load: float = 0.0,
        oil_temperature: float = 313.15,
        period: float = SAMPLE_PERIOD,
    ) -> None:
        super().__init__()
        check_temperature(unit, constant(oil_temperature))
        model = audited_circuit(unit)
        self._circuits = {unit.name: ("", model)}
        state = initial_state(unit, model, start_position, load)
        values = model.parameters(oil_temperature=oil_temperature)
        self.unit, self._name = unit, unit.name
        self._run = _Stepped(model.ode, values, state, np.array([0.0, load]), period)
        self.now = self._look()

    def __getstate__(self) -> dict[str, Any]:
        """What is this unit's own: its equation is made of the unit again, for it cannot be pickled."""
        own = {**vars(self), "_run": {**vars(self._run)}}
        del own["_circuits"], own["_run"]["ode"]
        return own

    def __setstate__(self, own: Mapping[str, Any]) -> None:
        model = audited_circuit(own["unit"])
        self.__dict__.update(own)
        self._circuits = {self._name: ("", model)}
        self._run = _Stepped.__new__(_Stepped)
        vars(self._run).update(own["_run"], ode=model.ode)

    def advance(self, motor_speed: float, load: float) -> Instant:
        """Go on to the next sample.

        Args:
            motor_speed: command that is reached there, evenly [rad/s].
            load: there [N].

        Returns:
            The truth there.

        Raises:
            SimulationError: the equations cannot be followed so far.
        """
        self._run.advance(np.array([motor_speed, load]))
        self._enter()
        self.now = self._look()
        return self.now

    def _look(self) -> Instant:
        run, name = self._run, self._name
        return Instant(
            time=run.time,
            position={name: float(run.state[run.ode.state_index("position")])},
            motor_speed={name: run.speed("motor_speed", float(run.inputs[0]))},
            motor_torque={name: float(run.found()["motor_torque"][0])},
        )


class LiveMachine(_Live):
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
        super().__init__()
        self.machine = machine
        model = audited_model(machine)
        self._circuits = {name: (f"{name}.", terms) for name, terms in model.audit_terms.items()}
        values = model.values.copy()
        for unit in machine.units:
            check_temperature(unit, constant(oil_temperature[unit.name]))
            values[model.ode.parameters.index(f"{unit.name}.oil_temperature")] = oil_temperature[unit.name]
        state = start_state(machine, model, start_position, payload)
        inputs = np.array([*(0.0 for _ in machine.mechanism.cylinders), payload, 0.0, 0.0])
        self._run = _Stepped(model.ode, values, state, inputs, period)
        self.now = self._look()

    def advance(
        self, motor_speed: Mapping[str, float], payload: float, tip_force: tuple[float, float] = (0.0, 0.0)
    ) -> LinkedInstant:
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
        speeds = (motor_speed[name] for name in self.machine.mechanism.cylinders)
        self._run.advance(np.array([*speeds, payload, *tip_force]))
        self._enter()
        self.now = self._look()
        return self.now

    def _look(self) -> LinkedInstant:
        names, run = self.machine.mechanism.cylinders, self._run
        found, commanded = run.found(), [float(value) for value in run.inputs[: len(names)]]
        return LinkedInstant(
            time=run.time,
            position={name: float(found[f"{name}.position"][0]) for name in names},
            motor_speed={n: run.speed(f"{n}.motor_speed", w) for n, w in zip(names, commanded, strict=True)},
            motor_torque={name: float(found[f"{name}.motor_torque"][0]) for name in names},
            tip=(float(found["tip_x"][0]), float(found["tip_z"][0])),
        )


@dataclass
class LiveReport:
    """What a drive reports, sample by sample, with the rounding and the noise of `report`."""

    how: DriveReport = field(default_factory=DriveReport)  # rounding and noise, and by how much it is off
    stream: int = 0  # of drives with the same seed, which one; each has noise of its own

    def __post_init__(self) -> None:
        self._random = np.random.default_rng([self.how.seed, self.stream])
        self._speeds = np.random.default_rng([self.how.seed, self.stream, SPEEDS])

    def sample(self, time: float, motor_speed: float, motor_torque: float, oil_temperature: float) -> Reported:
        """Report one sample; all in SI."""
        torque_noise, temperature_noise = self._random.standard_normal(2).tolist()
        noise = torque_noise, temperature_noise
        if self.how.speed_noise > 0.0:
            motor_speed += self.how.speed_noise * float(self._speeds.standard_normal())
        return Reported(time, *self.how.sample(motor_speed, motor_torque, oil_temperature, noise))
