"""Where a circuit's pumps deliver to, which its description does not have in one place: its balance shows it."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from ramsight.plant.balance import Balance
from ramsight.plant.oil import T40
from ramsight.sensor.thresholds import MIXED_FRICTION_SPEED, SAMPLE, VALVE_SETTLED


@lru_cache(maxsize=256)
def delivers(balance: Balance, node: str, way: float) -> bool:
    """Whether the pumps press oil into a node while the motor turns one way and the piston is held.

    Args:
        balance: of the unit.
        node: of the circuit.
        way: +1 or -1, the sign of the motor's speed, or of a directional valve's command: 1 extends.
    """
    place = balance.states.index(f"pressure_{node}")
    rest = balance.at_rest(0.5 * balance.unit.cylinder.stroke, 0.0)
    # A motor that turns one way only fills either chamber as its valve is commanded.
    commands = dict.fromkeys(balance.model.commands, way)
    turns = 1.0 if commands else way
    p = balance.parameters_at(balance.values, T40, commands)
    speed = turns * MIXED_FRICTION_SPEED  # as slow as a pump surely delivers, so that no valve opens
    z: Any = rest  # an array of numbers at first, then CasADi's
    for _ in range(round(VALVE_SETTLED / SAMPLE)):
        z = balance.step(z, speed, speed, 0.0, 0.0, p, SAMPLE, held=1.0, settles=True).z
    return bool(z[place] > rest[place])


def one_sided(balance: Balance) -> bool:
    """Whether the pumps press on the held side of the piston only, whichever way the motor turns."""
    cylinder = balance.unit.cylinder
    other = cylinder.node_b if balance.unit.held == "a" else cylinder.node_a
    return not any(delivers(balance, other, way) for way in (1.0, -1.0))
