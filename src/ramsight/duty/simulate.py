"""Run a unit through a duty and label what comes out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ramsight.duty.audit import audit, refuse_dry
from ramsight.duty.profile import Duty, Profile
from ramsight.duty.recorded import Owner, Recorded, Signal, computed
from ramsight.engine.run import DEFAULT_MAX_STEPS, DEFAULT_RTOL, Outcome, Segments, Trajectory, integrate, outputs
from ramsight.errors import DescriptionError, SimulationError, UnknownNameError
from ramsight.logs.channels import column_of
from ramsight.plant.circuit import COMMANDED, CircuitModel
from ramsight.plant.unit import HydraulicUnit, circuit, initial_state
from ramsight.signals import Dataset
from ramsight.units import FREEZING

SAMPLE_PERIOD = 0.02  # s
_ROUNDING = 1e-6  # K, between degC and K


@lru_cache(maxsize=32)
def audited_circuit(unit: HydraulicUnit) -> CircuitModel:
    """The unit's equation with its audit's integrals; the same unit gives the same object."""
    return circuit(unit, audited=True)


def check_temperature(unit: HydraulicUnit, temperature: Profile) -> None:
    """Reject an oil temperature [K] that is anywhere outside the range that the oil's data hold for.

    Raises:
        DescriptionError: it is; the text names oil, temperature and range.
    """
    low, high = unit.oil.temperatures
    for value in (float(temperature.value.min()), float(temperature.value.max())):
        if not low - _ROUNDING <= value <= high + _ROUNDING:
            raise DescriptionError(
                f"the data of the oil {unit.oil.name} do not reach so far",
                key="oil temperature",
                value=f"{value - FREEZING:.6g} degC",
                allowed=f"{low - FREEZING:.6g} to {high - FREEZING:.6g} degC",
            )


def check_commands(model: CircuitModel, duty: Duty) -> None:
    """Refuse commands to parts that take none.

    Raises:
        UnknownNameError: there is such a command.
    """
    for name in duty.commands:
        if name not in model.commands:
            raise UnknownNameError("commanded part", name, model.commands, where=model.ode.name)


def simulate(
    unit: HydraulicUnit,
    duty: Duty,
    *,
    sample_period: float = SAMPLE_PERIOD,
    rtol: float = DEFAULT_RTOL,
    max_steps: int = DEFAULT_MAX_STEPS,
    advance: Callable[[float], object] | None = None,
) -> Dataset:
    """Simulate a unit.

    Args:
        unit: the machine's unit.
        duty: what it is asked to do.
        sample_period: distance of the samples [s].
        rtol: relative tolerance of the integrator.
        max_steps: steps after which a run is abandoned.
        advance: called now and then with the simulated seconds since the last call.

    Returns:
        A Dataset over `time` [s] with position, velocity, pressures, motor speed and torque, flows, openings and
        loss powers, each with `units`; its attributes carry the energy and volume audit, and with it what the
        battery gave and took.

    Raises:
        DescriptionError: the duty's oil temperature is outside the range that the oil's data hold for.
        SimulationError: if the run does not reach its end; the text states where and what to do.
    """
    return simulated(unit, duty, sample_period=sample_period, rtol=rtol, max_steps=max_steps, advance=advance).dataset()


def simulated(
    unit: HydraulicUnit,
    duty: Duty,
    *,
    sample_period: float = SAMPLE_PERIOD,
    rtol: float = DEFAULT_RTOL,
    max_steps: int = DEFAULT_MAX_STEPS,
    advance: Callable[[float], object] | None = None,
) -> Recorded:
    """The same run before it is a Dataset; arguments and errors as `simulate`."""
    done = ran(unit, duty, sample_period=sample_period, rtol=rtol, max_steps=max_steps, advance=advance)
    return labelled(unit, duty, done)


@dataclass(frozen=True)
class Ran:
    """A run before it is labelled: the model, its inputs and what came out of them at the samples."""

    model: CircuitModel
    segments: Segments
    trajectory: Trajectory


def ran(
    unit: HydraulicUnit,
    duty: Duty,
    *,
    sample_period: float = SAMPLE_PERIOD,
    rtol: float = DEFAULT_RTOL,
    max_steps: int = DEFAULT_MAX_STEPS,
    advance: Callable[[float], object] | None = None,
    model: CircuitModel | None = None,
) -> Ran:
    """Run a unit through a duty; arguments and errors as `simulate`, and perhaps its audited equation."""
    check_temperature(unit, duty.oil_temperature)
    model = model or audited_circuit(unit)
    check_commands(model, duty)
    ode = model.ode
    segments = duty.segments(model.values, ode.parameters)
    count = int(np.floor(duty.duration / sample_period + 1e-9)) + 1
    time = np.minimum(np.arange(count) * sample_period, duty.duration)
    start_load, start_speed = float(duty.load(0.0)), float(duty.motor_speed(0.0))
    initial = initial_state(unit, model, duty.start_position, start_load, start_speed)
    run = integrate(ode, initial, segments, time, rtol=rtol, max_steps=max_steps, record_steps=True, advance=advance)
    if run.outcome is not Outcome.DONE:
        raise SimulationError(f"{ode.name}: {run.message}")
    refuse_dry(ode, run.step_time, run.step_state)
    return Ran(model, segments, run)


def labelled(unit: HydraulicUnit, duty: Duty, done: Ran) -> Recorded:
    """A run with its signals' names and units, and its audit."""
    model, segments, run = done.model, done.segments, done.trajectory
    ode, time, own = model.ode, run.time, Owner()
    signals = {
        "time": Signal(time, "s", "time"),
        "position": Signal(run.state[:, ode.state_index("position")], "m", "piston position, 0 = retracted"),
        "velocity": Signal(run.state[:, ode.state_index("velocity")], "m/s", "piston velocity, positive extends"),
        **own.drive(ode, run.state, time, duty.motor_speed, duty.oil_temperature),
        "load": Signal(duty.load(time), "N", "load force, positive against lifting"),
    }
    for name in model.commands:
        known = duty.commanded(name, time) if name in duty.commands else np.full(len(time), COMMANDED)
        signals[column_of(name)] = Signal(known, "1", f"command to {name}")
    signals |= own.pressures(ode, run.state, model.nodes)
    signals |= computed(ode, outputs(ode, segments, time, run.state))
    attrs: dict[str, Any] = {"format": 1, "kind": "simulated run", "unit": ode.name}
    attrs |= {"accepted_steps": run.accepted, "rejected_steps": run.rejected}
    attrs |= audit(model, segments, run)
    return Recorded(signals, attrs | own.electrical(unit.drive.supply, attrs))
