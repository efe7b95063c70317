"""The oil warms up by what is lost in it: two heat stores, pump cases and tank (`ramsight.plant.heat`).

What warms them are the losses of the run itself, and the viscosity of the run is that of the oil in the pumps' gaps,
which has the cases' temperature. Losses change with the temperature and it with them: a few rounds agree.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.profile import Duty, Profile
from ramsight.duty.recorded import Recorded, Signal
from ramsight.duty.simulate import SAMPLE_PERIOD, Ran, check_temperature, labelled, ran
from ramsight.errors import SimulationError
from ramsight.plant.heat import ROOM, HeatStores, case_losses, shared_out
from ramsight.plant.unit import HydraulicUnit
from ramsight.progress import advancing
from ramsight.signals import Dataset

_AGREE = 0.05  # K; the piece over which a changing temperature is held
_ROUNDS = 12
_STEP = 1.0  # s, between the corners of the temperatures; cases and tanks take minutes


def warmed(unit: HydraulicUnit, duty: Duty, stores: HeatStores | None = None, **how: Any) -> Dataset:
    """The run of `warm_run`, whose arguments and errors these are, as a Dataset."""
    return warm_run(unit, duty, stores, **how).dataset()


def warm_run(
    unit: HydraulicUnit,
    duty: Duty,
    stores: HeatStores | None = None,
    *,
    ambient: float = ROOM,
    sample_period: float = SAMPLE_PERIOD,
    rtol: float = 1e-6,
    progress: bool = False,
) -> Recorded:
    """Simulate a unit whose losses warm up its oil.

    Args:
        duty: what it is asked to do; its oil temperature at the beginning is that of cases and tank.
        stores: of heat; by default those of its description, or of a unit of some kW where it has none.
        ambient: temperature of the air [K].
        sample_period: distance of the samples [s].
        rtol: relative tolerance of the integrator.
        progress: show a bar for each round on a terminal if it takes long.

    Returns:
        As `simulate`, with `pump_temperature`, of the oil in the pumps' gaps, by which the run went, and
        `oil_temperature`, of the tank, which is what a thermometer reports [K].

    Raises:
        DescriptionError: the oil becomes warmer than its data hold for.
        SimulationError: temperatures and losses do not agree after some rounds.
    """
    stores = stores or unit.heat or HeatStores()
    first = float(duty.oil_temperature(0.0))
    case = Profile([0.0], [first])
    for count in range(_ROUNDS):
        with advancing(duty.duration, f"simulating, round {count + 1}", shown=progress) as advance:
            asked = replace(duty, oil_temperature=case)
            done = ran(unit, asked, sample_period=sample_period, rtol=rtol, advance=advance)
        time = done.trajectory.time
        corners = np.unique(np.append(np.arange(0.0, time[-1], _STEP), time[-1]))
        into_case, into_tank = (np.interp(corners, time, heat) for heat in heats(unit, done))
        found = stores.temperatures(corners, into_case, into_tank, first, ambient)
        apart = float(np.abs(case(corners) - found[:, 0]).max())
        if apart < _AGREE:
            break
        case = Profile(corners, np.clip(found[:, 0], *unit.oil.temperatures))
    else:
        check_temperature(unit, Profile(corners, found[:, 0]))
        raise SimulationError(f"{done.model.ode.name}: losses and temperatures are still {apart:.2g} K apart")
    run = labelled(unit, asked, done)
    warm = {
        "pump_temperature": Signal(run["oil_temperature"].values, "K", "temperature of the oil in the pumps"),
        "oil_temperature": Signal(np.interp(time, corners, found[:, 1]), "K", "temperature of the oil in the tank"),
    }
    return replace(run, signals={**run.signals, **warm})


def heats(unit: HydraulicUnit, done: Ran) -> tuple[Array, Array]:
    """Heat into the pumps' cases and into the other oil since the beginning [J], at the samples of a run."""
    ode, state = done.model.ode, done.trajectory.state
    energies = {name: state[:, ode.state_index(f"energy.{name}")] for name in done.model.losses}
    nothing = np.zeros(len(state))
    into_case, into_oil = shared_out(case_losses(unit.parts()), energies)
    return nothing + into_case, nothing + into_oil
