"""Pumps that starve: what they draw is known no better than the pressure from which they fill."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca

from ramsight.plant.balance import Balance
from ramsight.plant.pump import Pump


def unfilled(balance: Balance, z: Any, parameters: Callable[[str], Any], speed: Any, std: float) -> Any:
    """Standard deviation of the share of a pump's chambers that fills [1], of the pump of which it is largest.

    Chambers that fill whatever the inlet lets through are sure to; of those that do not, what comes in is as uncertain
    as the way in: half of what lies between one that passes `std` more and one that passes as much less.

    Args:
        balance: of the unit.
        z: the circuit's states.
        parameters: symbols of the circuit's parameters by name.
        speed: of the motor [rad/s].
        std: standard deviation of the flow that the way in passes, over it [1].
    """
    tank = parameters("tank.pressure")
    largest: Any = 0.0
    for part in balance.unit.parts():
        if isinstance(part, Pump) and part.filling is not None:
            passes = parameters(f"{part.name}.filling")
            pump = replace(part, displacement=parameters(f"{part.name}.displacement"))
            inlet, outlet = (balance.pressure(z, node, tank) for node in (part.inlet, part.outlet))
            more, less = (
                replace(pump, filling=passes * (1.0 + way * std)).filled(part.belt * speed, inlet, outlet)
                for way in (1.0, -1.0)
            )
            largest = ca.fmax(largest, 0.5 * (more - less))
    return largest
