"""Oil over a relief valve: near its setting nobody can say where the pump's oil goes."""

from __future__ import annotations

from typing import Any

import casadi as ca

from ramsight.plant.balance import Balance
from ramsight.plant.circuit import TANK
from ramsight.plant.valve import ReliefValve

_BEGINS = 0.9
"""Share of a setting from which its valve may let oil pass: direct acting valves close 10 to 15 % below it,
pilots leak from 85 %, and what is lifted with more is rare."""


def passing(balance: Balance, z: Any, parameters: Any) -> Any:
    """How likely it is that oil passes one of a circuit's relief valves, 0 to 1.

    It grows with the pressure from where a valve begins to open to its setting, the valve that is nearest counting.

    Args:
        balance: of the unit.
        z: the circuit's states.
        parameters: symbols of the circuit's parameters by name.
    """
    tank = parameters("tank.pressure")

    def pressure(node: str) -> Any:
        return tank if node == TANK else z[balance.states.index(f"pressure_{node}")]

    share: Any = 0.0
    for part in balance.unit.parts():
        if isinstance(part, ReliefValve):
            risen = (pressure(part.inlet) - pressure(part.outlet)) / parameters(f"{part.name}.setting")
            share = ca.fmax(share, (risen - _BEGINS) / (1.0 - _BEGINS))
    return ca.fmin(ca.fmax(share, 0.0), 1.0)
