"""What a machine with a mechanism is asked to do, and the run that follows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.audit import audit_linked, refuse_dry
from ramsight.duty.profile import Profile, all_corners, constant, held_corners, rates
from ramsight.duty.recorded import Owner, Recorded, Signal, computed
from ramsight.duty.simulate import SAMPLE_PERIOD, check_temperature
from ramsight.engine.run import DEFAULT_MAX_STEPS, DEFAULT_RTOL, Outcome, Segments, integrate, outputs
from ramsight.errors import SimulationError
from ramsight.plant.circuit import WARMING
from ramsight.plant.linkage import angles
from ramsight.plant.linked import LinkedMachine, LinkedModel, linked_model, start_state
from ramsight.signals import Dataset


@dataclass(frozen=True, eq=False)
class LinkedDuty:
    """What a machine's units are asked to do, and what works on the mechanism meanwhile."""

    motor_speed: Mapping[str, Profile]  # command to each unit's drive [rad/s]; positive extends
    oil_temperature: Mapping[str, Profile]  # of each unit [K]
    start_position: Mapping[str, float]  # of each unit's piston [m]
    payload: Profile = field(default_factory=lambda: constant(0.0))  # [kg]
    # tip_force_x, tip_force_z: force on the tip, forward and up [N]
    tip_force_x: Profile = field(default_factory=lambda: constant(0.0))
    tip_force_z: Profile = field(default_factory=lambda: constant(0.0))
    end: float | None = None  # when the duty ends [s]; by default at the last corner of any speed
    phases: tuple[tuple[str, float], ...] = ()  # names of parts of the duty and when each begins [s]

    @property
    def duration(self) -> float:
        """Length of the duty [s]."""
        return max(float(speed.time[-1]) for speed in self.motor_speed.values()) if self.end is None else self.end

    @property
    def works(self) -> tuple[Profile, Profile, Profile]:
        """What works on the mechanism beside its cylinders, in the order of the equation's inputs."""
        return self.payload, self.tip_force_x, self.tip_force_z

    def inputs(self, units: tuple[str, ...], time: Array) -> Array:
        """Inputs of the equation, in SI units, at times [s], shape (times, inputs)."""
        return np.column_stack([profile(time) for profile in (*(self.motor_speed[u] for u in units), *self.works)])

    def segments(self, units: tuple[str, ...], model: LinkedModel) -> Segments:
        """The duty as the engine's segments.

        Args:
            units: names, in the order of the mechanism's cylinders.
            model: the machine's equation.
        """
        temperatures = [self.oil_temperature[unit] for unit in units]
        bends = [profile.time for profile in (*self.motor_speed.values(), *self.works)]
        corner = all_corners([*bends, *(held_corners(t) for t in temperatures)], self.duration)
        inputs = self.inputs(units, corner)
        slope = np.diff(inputs, axis=0) / np.diff(corner)[:, None]
        middle = 0.5 * (corner[:-1] + corner[1:])
        held = np.column_stack([temperature(middle) for temperature in temperatures])
        parameters = np.tile(model.values, (len(middle) if np.any(np.ptp(held, axis=0) > 0.0) else 1, 1))
        for unit, column in zip(units, held.T, strict=True):
            parameters[:, model.ode.parameters.index(f"{unit}.oil_temperature")] = column[: len(parameters)]
            if (warming := f"{unit}.{WARMING}") in model.ode.parameters:
                change = rates(self.oil_temperature[unit], corner)
                parameters[:, model.ode.parameters.index(warming)] = change[: len(parameters)]
        return Segments(corner[:-1], corner[1:], np.ascontiguousarray(inputs[:-1]), slope, parameters)


@lru_cache(maxsize=8)
def audited_model(machine: LinkedMachine) -> LinkedModel:
    """The machine's equation with its audit's integrals; the same machine gives the same object."""
    return linked_model(machine, audited=True)


def starting(machine: LinkedMachine, model: LinkedModel, duty: LinkedDuty) -> Array:
    """States at rest where a duty begins, shape (states,)."""
    payload, force_x, force_z = (float(work(0.0)) for work in duty.works)
    speeds = {name: float(speed(0.0)) for name, speed in duty.motor_speed.items()}
    return start_state(machine, model, duty.start_position, payload, (force_x, force_z), speeds)


def simulate_linked(
    machine: LinkedMachine,
    duty: LinkedDuty,
    *,
    sample_period: float = SAMPLE_PERIOD,
    rtol: float = DEFAULT_RTOL,
    max_steps: int = DEFAULT_MAX_STEPS,
    advance: Callable[[float], object] | None = None,
) -> Dataset:
    """Simulate units and the mechanism that they move.

    Args:
        machine: units and mechanism.
        duty: what they are asked to do.
        sample_period: distance of the samples [s].
        rtol: relative tolerance of the integrator.
        max_steps: steps after which the run is abandoned.
        advance: called now and then with the simulated seconds since the last call.

    Returns:
        A Dataset over `time` [s]. Of the mechanism: `joint_*` (coordinates of the free joints), `angle_*` (by which
        each body is turned), `tip_x`, `tip_z`, `payload`, `tip_force_x`, `tip_force_z`, `kinetic`, `potential`. Of each
        unit what `simulate` returns, with the unit's name before it (`boom_position`); `unit_run` takes it out. Each
        variable has `units`; the attributes carry the audits of each unit, of the mechanism and of all.

    Raises:
        DescriptionError: an oil temperature is out of range, or the mechanism cannot be assembled at the start.
        SimulationError: if the run does not reach its end; the text states where and what to do.
    """
    return simulated_linked(
        machine, duty, sample_period=sample_period, rtol=rtol, max_steps=max_steps, advance=advance
    ).dataset()


def simulated_linked(
    machine: LinkedMachine,
    duty: LinkedDuty,
    *,
    sample_period: float = SAMPLE_PERIOD,
    rtol: float = DEFAULT_RTOL,
    max_steps: int = DEFAULT_MAX_STEPS,
    advance: Callable[[float], object] | None = None,
) -> Recorded:
    """The same run as columns or as a Dataset; arguments and errors as `simulate_linked`."""
    for unit in machine.units:
        check_temperature(unit, duty.oil_temperature[unit.name])
    model = audited_model(machine)
    ode, names = model.ode, machine.mechanism.cylinders
    segments = duty.segments(names, model)
    count = int(np.floor(duty.duration / sample_period + 1e-9)) + 1
    time = np.minimum(np.arange(count) * sample_period, duty.duration)
    start = starting(machine, model, duty)
    run = integrate(ode, start, segments, time, rtol=rtol, max_steps=max_steps, record_steps=True, advance=advance)
    if run.outcome is not Outcome.DONE:
        raise SimulationError(f"{ode.name}: {run.message}")
    refuse_dry(ode, run.step_time, run.step_state)
    attributes: dict[str, Any] = {"format": 1, "kind": "simulated run", "machine": machine.name}
    attributes |= {"units": " ".join(names), "accepted_steps": run.accepted, "rejected_steps": run.rejected}
    attributes |= audit_linked(model, segments, run)
    for unit in machine.units:
        attributes |= Owner(unit.name).electrical(unit.drive.supply, attributes)
    return Recorded(_signals(machine, duty, model, segments, time, run.state), attributes)


def _signals(
    machine: LinkedMachine, duty: LinkedDuty, model: LinkedModel, segments: Segments, time: Array, state: Array
) -> dict[str, Signal]:
    """Every signal of the mechanism and of its units."""
    mechanism, ode = machine.mechanism, model.ode
    signals = {"time": Signal(time, "s", "time")}
    count = len(mechanism.joints)
    for k, known in enumerate(ode.states[: 2 * count]):
        what = "coordinate" if k < count else "rate"
        signals[known.name] = Signal(state[:, k], known.unit, f"{what} of the joint of {mechanism.joints[k % count]}")
    for name, values in angles(mechanism, state[:, :count]).items():
        signals[f"angle_{name}"] = Signal(values, "rad", f"angle by which {name} is turned, up positive")
    signals["payload"] = Signal(duty.payload(time), "kg", "payload")
    signals["tip_force_x"] = Signal(duty.tip_force_x(time), "N", "force on the tip, forward")
    signals["tip_force_z"] = Signal(duty.tip_force_z(time), "N", "force on the tip, up")
    for unit in machine.units:
        name, owner = unit.name, Owner(unit.name)
        signals |= owner.drive(ode, state, time, duty.motor_speed[name], duty.oil_temperature[name])
        signals |= owner.pressures(ode, state, model.audit_terms[name].nodes)
    return signals | computed(ode, outputs(ode, segments, time, state), mechanism.cylinders)


def unit_run(run: Dataset, unit: str) -> Dataset:
    """One unit's part of a run, as if it had been simulated alone; what `report` and the studies take.

    Args:
        run: a Dataset as `simulate_linked` returns it.
        unit: name of the unit.

    Returns:
        A Dataset with the names that `simulate` gives.

    Raises:
        KeyError: the run has no such unit.
    """
    if unit not in str(run.attrs["units"]).split():
        raise KeyError(f"no unit {unit!r} in this run; it has {run.attrs['units']}")
    names = {name: str(name).removeprefix(f"{unit}_") for name in run if str(name).startswith(f"{unit}_")}
    part = run[list(names)].rename(names)
    own = {key.removeprefix(f"{unit}."): v for key, v in run.attrs.items() if key.startswith(f"{unit}.")}
    part.attrs = {key: run.attrs[key] for key in ("format", "kind", "accepted_steps", "rejected_steps")}
    part.attrs |= {"unit": unit} | own
    return part
