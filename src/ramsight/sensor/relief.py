"""Oil over a relief valve: near its setting nobody can say where the pump's oil goes."""

from __future__ import annotations

from typing import Any

import casadi as ca

from ramsight.plant.balance import Balance
from ramsight.plant.valve import ReliefValve
from ramsight.sensor.pumping import delivers

_RANGE = 10.0 / 3.0
"""Standard deviations of a setting below it from which its valve may let oil pass. With 3 % that is 90 % of a setting:
direct acting valves close 10 to 15 % below it, pilots leak from 85 %, and what is lifted with more is rare."""


_PUSHED = 0.5
"""Standard deviation of the oil that passed over that of the pump, where a valve surely opened: what stopped the piston
may also push it back."""


def passed_share(doubt: Any) -> tuple[Any, Any]:
    """What of the pump's oil has passed a valve: mean and standard deviation over all of it [1].

    A pressure near a setting may be a heavy load's; one at the setting is held there by the valve. The mean counts from
    the middle of the range on, where the valve is likelier than such a load. The deviation counts from its beginning,
    with the square of `passing` for the probability that all of it has passed: the setting may be low.
    """
    probable = doubt**2
    return ca.fmax(2.0 * doubt - 1.0, 0.0), ca.sqrt(probable * (1.0 - probable) + (_PUSHED * probable) ** 2)


def held_back(doubt: Any, tolerance: float) -> Any:
    """Share of a pressure by which a valve that opens early may hold it lower than described [1].

    Args:
        doubt: at that pressure, by `passing`.
        tolerance: standard deviation of a setting over it [1].
    """
    return _RANGE * tolerance * doubt


def passing(balance: Balance, z: Any, parameters: Any, speed: Any, tolerance: float) -> Any:
    """How likely it is that oil passes one of a circuit's relief valves, 0 to 1.

    It grows with the pressure from where a valve begins to open to its setting, the valve that is nearest counting.
    A pump that draws from a valve's side lets nothing pass there, however much pressure is left from before.

    Args:
        balance: of the unit.
        z: the circuit's states.
        parameters: symbols of the circuit's parameters by name.
        speed: of the motor [rad/s].
        tolerance: standard deviation of a setting over it [1].
    """
    tank = parameters("tank.pressure")
    share: Any = 0.0
    for part in balance.unit.parts():
        if isinstance(part, ReliefValve):
            inlet, outlet = (balance.pressure(z, node, tank) for node in (part.inlet, part.outlet))
            risen = (inlet - outlet) / parameters(f"{part.name}.setting")
            near = 1.0 - (1.0 - risen) / (_RANGE * tolerance)
            for way in (1.0, -1.0):
                if not delivers(balance, part.inlet, way):
                    near = ca.if_else(way * speed > 0.0, 0.0, near)
            share = ca.fmax(share, near)
    return ca.fmin(ca.fmax(share, 0.0), 1.0)
