"""Pumps that starve: what they draw is known no better than the pressure from which they fill."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca

from ramsight.expression import Real, Scalar, Vector
from ramsight.plant.pump import Pump
from ramsight.sensor.machine_model import MachineModel


def unfilled_std(z: Vector, speed: Scalar, model: MachineModel) -> Real:
    """Standard deviation of the share of a pump's chambers that fills [1], of the pump of which it is largest.

    Chambers that fill whatever the inlet lets through are certain to; of those that do not, what comes in is as
    uncertain as the way in: half of what lies between one that passes a standard deviation more and one that passes as
    much less.

    Args:
        z: the circuit's states.
        speed: of the motor [rad/s].
        model: of the machine.
    """
    balance, tank, std = model.balance, model.of_circuit("tank.pressure"), model.assumed.machine.filling
    largest: Real = 0.0
    for part in balance.unit.parts():
        if isinstance(part, Pump) and part.filling is not None:
            passes = model.of_circuit(f"{part.name}.filling")
            changed: dict[str, Any] = {"displacement": model.of_circuit(f"{part.name}.displacement")}
            pump = replace(part, **changed)  # a part's law takes symbols for its numbers
            inlet, outlet = (balance.pressure(z, node, tank) for node in (part.inlet, part.outlet))
            more, less = (
                _with_filling(pump, passes * (1.0 + way * std)).filled(part.belt * speed, inlet, outlet)
                for way in (1.0, -1.0)
            )
            largest = ca.fmax(largest, 0.5 * (more - less))
    return largest


def _with_filling(pump: Pump, passes: Scalar) -> Pump:
    """A pump with another flow that its way in passes."""
    changed: dict[str, Any] = {"filling": passes}
    return replace(pump, **changed)
