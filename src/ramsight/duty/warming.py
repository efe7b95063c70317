"""The oil warms up by what is lost in it: pump case and tank as two heat stores, and a thermometer that sees one.

    C_c dT_c/dt = P_pumps - G_ct (T_c - T_t) - G_ca (T_c - T_a)
    C_t dT_t/dt = P_oil   + G_ct (T_c - T_t) - G_ta (T_t - T_a)

P_pumps is what leakage and friction of the pumps lose, P_oil what valves and hoses throttle; both are those of the run
itself. The oil in the pumps' gaps has the case's temperature, and the viscosity of the run is that oil's; a thermometer
in the tank reports the other one. Losses change with the temperature and the temperature with them: a few rounds agree.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ramsight.duty.profile import Duty, Profile
from ramsight.duty.simulate import SAMPLE_PERIOD, Ran, check_temperature, labelled, ran
from ramsight.errors import SimulationError
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

_AGREE = 0.05  # K; the piece over which a changing temperature is held
_ROUNDS = 12
_STEP = 1.0  # s, between the corners of the temperatures; cases and tanks take minutes
_INTO_OIL = ".throttling"
_INTO_CASE = (".leakage", ".friction")


@dataclass(frozen=True)
class Warming:
    """Heat stores of a unit and their ways to each other and to the air.

    Args:
        ambient: temperature of the air [K].
        case: heat capacity of the pumps' cases with the oil in them [J/K]; 8 kg of iron and 0.3 l.
        tank: of the tank with its oil [J/K]; 20 l and 10 kg of steel.
        case_to_tank: conductance by the oil that passes the pumps [W/K]; 0.2 l/s carry it away.
        case_to_air: [W/K]; 0.3 m2 at 10 W/m2/K.
        tank_to_air: [W/K]; 1 m2 at 15 W/m2/K.

    Source: capacities from masses, 460 J/kg/K of steel and 1.9 kJ/kg/K of oil; heat transfer of still air to walls, 8
    to 15 W/m2/K, the usual range of textbooks; 1.66 kJ/K of a litre of oil.
    """

    ambient: float = 293.15
    case: float = 4.2e3
    tank: float = 37e3
    case_to_tank: float = 300.0
    case_to_air: float = 3.0
    tank_to_air: float = 15.0

    def temperatures(self, time: Array, into_case: Array, into_tank: Array, first: float) -> Array:
        """Temperatures of case and tank [K], shape (times, 2).

        Args:
            time: [s], shape (times,).
            into_case: heat into the cases since the beginning [J], shape (times,).
            into_tank: the same into the other oil [J].
            first: temperature of both at the beginning [K].
        """
        found = np.empty((len(time), 2))
        found[0] = first
        heat = np.diff(np.column_stack([into_case, into_tank]), axis=0)
        for k, dt in enumerate(np.diff(time)):
            found[k + 1] = self.after(found[k], float(dt), heat[k])
        return found

    @cached_property
    def _capacity(self) -> Array:
        """Heat capacity of both stores [J/K]."""
        return np.array([self.case, self.tank])

    @cached_property
    def _rate(self) -> Array:
        """By which the stores' temperatures follow themselves, and the air's [1/s], shape (2, 3)."""
        to_air = np.array([self.case_to_air, self.tank_to_air])
        between = self.case_to_tank * np.array([[-1.0, 1.0], [1.0, -1.0]])
        return np.asarray(np.column_stack([between - np.diag(to_air), to_air]) / self._capacity[:, None])

    def after(self, stores: Array, dt: float, heat: Array) -> Array:
        """Temperatures of case and tank after a time [K], shape (2,).

        Args:
            stores: the same before [K].
            dt: time [s].
            heat: that came into each meanwhile, evenly [J], shape (2,).

        Example:
            >>> Warming(ambient=293.15).after(np.array([313.15, 313.15]), 60.0, np.zeros(2)).round(2).tolist()
            [312.54, 312.64]
        """
        rate = self._rate[:, :2]
        right = heat / dt / self._capacity + self._rate[:, 2] * self.ambient
        # Implicit midpoint: heat that leaves one store comes to the other, to the last digit.
        return np.asarray(np.linalg.solve(np.eye(2) - 0.5 * dt * rate, stores + dt * (0.5 * rate @ stores + right)))


def warmed(
    unit: Any, duty: Duty, how: Warming | None = None, *, sample_period: float = SAMPLE_PERIOD, rtol: float = 1e-6
) -> xarray.Dataset:
    """Simulate a unit whose losses warm up its oil.

    Args:
        unit: the unit.
        duty: what it is asked to do; its oil temperature is that of everything at first.
        how: heat stores; by default those of a unit of some kW.
        sample_period: distance of the samples [s].
        rtol: relative tolerance of the integrator.

    Returns:
        As `simulate`, with `pump_temperature`, of the oil in the pumps' gaps, by which the run went, and
        `oil_temperature`, of the tank, which is what a thermometer reports [K].

    Raises:
        DescriptionError: the oil becomes warmer than its data hold for.
        SimulationError: temperatures and losses do not agree after some rounds.
    """
    how = how or Warming()
    first = float(duty.oil_temperature(0.0))
    case = Profile([0.0], [first])
    for _ in range(_ROUNDS):
        done = ran(unit, replace(duty, oil_temperature=case), sample_period=sample_period, rtol=rtol)
        time = done.trajectory.time
        corners = np.unique(np.append(np.arange(0.0, time[-1], _STEP), time[-1]))
        into_case, into_tank = (np.interp(corners, time, heat) for heat in heats(unit, done))
        found = how.temperatures(corners, into_case, into_tank, first)
        apart = float(np.abs(case(corners) - found[:, 0]).max())
        if apart < _AGREE:
            break
        case = Profile(corners, np.clip(found[:, 0], *unit.oil.temperatures))
    else:
        check_temperature(unit, Profile(corners, found[:, 0]))
        raise SimulationError(f"{done.model.ode.name}: losses and temperatures are still {apart:.2g} K apart")
    run = labelled(unit, replace(duty, oil_temperature=case), done).dataset()
    run["pump_temperature"] = run["oil_temperature"].assign_attrs(long_name="temperature of the oil in the pumps")
    tank = np.interp(time, corners, found[:, 1])
    run["oil_temperature"] = ("time", tank, {"units": "K", "long_name": "temperature of the oil in the tank"})
    return run


def heats(unit: Any, done: Ran) -> tuple[Array, Array]:
    """Heat into the pumps' cases and into the other oil since the beginning [J], at the samples of a run."""
    ode, state = done.model.ode, done.trajectory.state
    energies = {name: state[:, ode.state_index(f"energy.{name}")] for name in done.model.losses}
    nothing = np.zeros(len(state))
    into_case, into_oil = shared_out(case_losses(unit), energies)
    return nothing + into_case, nothing + into_oil


def case_losses(unit: HydraulicUnit) -> frozenset[str]:
    """Names of the losses that warm the pumps' cases, ``pump_a.leakage``."""
    return frozenset(f"{part.name}{loss}" for part in unit.parts() if isinstance(part, Pump) for loss in _INTO_CASE)


def shared_out(of_pumps: Collection[str], losses: Mapping[str, Any]) -> tuple[Any, Any]:
    """Heat into the pumps' cases and into the other oil, of energies that were lost [J], numbers or columns.

    Args:
        of_pumps: names of the losses that warm the cases, `case_losses`.
        losses: by the circuit's names, ``pump_a.leakage``.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build_unit
        >>> losses = {"pump_a.leakage": 2.0, "hose_a.throttling": 3.0, "cylinder.friction": 5.0}
        >>> shared_out(case_losses(build_unit("ram", machine.load("press").unit("ram"))), losses)
        (2.0, 3.0)
    """
    into_case: Any = 0.0
    into_oil: Any = 0.0
    for name, energy in losses.items():
        if name in of_pumps:
            into_case = into_case + energy
        elif name.endswith(_INTO_OIL):
            into_oil = into_oil + energy
    return into_case, into_oil
