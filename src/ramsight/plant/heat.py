"""Heat stores of a unit: its pumps' cases and its tank, and how heat goes between them and to the air.

    C_c dT_c/dt = P_pumps - G_ct (T_c - T_t) - G_ca (T_c - T_a)
    C_t dT_t/dt = P_oil   + G_ct (T_c - T_t) - G_ta (T_t - T_a)

P_pumps is what leakage and friction of the pumps lose, P_oil what valves and hoses throttle. The oil in the pumps' gaps
has the case's temperature; a thermometer in the tank reports the other one.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.machine.parts import CASE_TO_AIR, TANK, TANK_TO_AIR
from ramsight.plant.circuit import Part
from ramsight.plant.pump import Pump

ROOM = 293.15  # K; 20 degC, the air where nobody says more
_INTO_OIL = ".throttling"
_INTO_CASE = (".leakage", ".friction")


@dataclass(frozen=True)
class HeatStores:
    """Capacities, and conductances between them and to the air.

    Source: capacities from masses, 460 J/kg/K of steel and 1.9 kJ/kg/K of oil; heat transfer of still air to walls, 8
    to 15 W/m2/K, the usual range of textbooks; 1.66 kJ/K of a litre of oil.
    """

    case: float = 4.2e3  # heat capacity of the pumps' cases with the oil in them [J/K]; 8 kg of iron and 0.3 l
    tank: float = TANK  # of the tank with its oil [J/K]; 20 l and 10 kg of steel
    case_to_tank: float = 300.0  # conductance by the oil that passes the pumps [W/K]; 0.2 l/s carry it away
    case_to_air: float = CASE_TO_AIR  # [W/K]; 0.3 m2 at 10 W/m2/K
    tank_to_air: float = TANK_TO_AIR  # [W/K]; 1 m2 at 15 W/m2/K

    def temperatures(self, time: Array, into_case: Array, into_tank: Array, first: float, ambient: float) -> Array:
        """Temperatures of case and tank [K], shape (times, 2).

        Args:
            time: [s], shape (times,).
            into_case: heat into the cases since the beginning [J], shape (times,).
            into_tank: the same into the other oil [J].
            first: temperature of both at the beginning [K].
            ambient: temperature of the air [K].
        """
        found = np.empty((len(time), 2))
        found[0] = first
        heat = np.diff(np.column_stack([into_case, into_tank]), axis=0)
        for k, dt in enumerate(np.diff(time)):
            found[k + 1] = self.after(found[k], float(dt), heat[k], ambient)
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

    def after(self, stores: Array, dt: float, heat: Array, ambient: float) -> Array:
        """Temperatures of case and tank after a time [K], shape (2,).

        Args:
            stores: the same before [K].
            dt: time [s].
            heat: that came into each meanwhile, evenly [J], shape (2,).
            ambient: temperature of the air [K].

        Example:
            >>> HeatStores().after(np.array([313.15, 313.15]), 60.0, np.zeros(2), 293.15).round(2).tolist()
            [312.54, 312.64]
        """
        rate = self._rate[:, :2]
        right = heat / dt / self._capacity + self._rate[:, 2] * ambient
        # Implicit midpoint: heat that leaves one store comes to the other, to the last digit.
        return np.asarray(np.linalg.solve(np.eye(2) - 0.5 * dt * rate, stores + dt * (0.5 * rate @ stores + right)))


def case_losses(parts: Sequence[Part]) -> frozenset[str]:
    """Names of the losses of these parts that warm the pumps' cases, ``pump_a.leakage``."""
    return frozenset(f"{part.name}{loss}" for part in parts if isinstance(part, Pump) for loss in _INTO_CASE)


def shared_out(of_pumps: Collection[str], losses: Mapping[str, Any]) -> tuple[Any, Any]:  # numbers or columns
    """Heat into the pumps' cases and into the other oil, of energies that were lost [J], numbers or columns.

    Args:
        of_pumps: names of the losses that warm the cases, `case_losses`.
        losses: by the circuit's names, ``pump_a.leakage``.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> losses = {"pump_a.leakage": 2.0, "hose_a.throttling": 3.0, "cylinder.friction": 5.0}
        >>> shared_out(case_losses(build(machine.load_machine("press").unit("ram"), "ram").parts()), losses)
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
