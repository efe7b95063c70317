"""Oil over a relief valve: near its setting the share of the pump's oil that passes it is uncertain."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.expression import Real, Scalar, Vector, scalar, within
from ramsight.plant.valve import ReliefValve
from ramsight.sensor.delivery import delivers
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import RELIEF_PUSH_SHARE, RELIEF_RANGE


@dataclass(frozen=True)
class Relief:
    """Oil over a relief valve.

    Attributes:
        probability: that the pump's oil passes one, 0 to 1.
        passed_std: standard deviation that the position has gained by it since a reference [m].
    """

    probability: Scalar
    passed_std: Scalar


def passed_share(probability: Scalar) -> tuple[Scalar, Scalar]:
    """What of the pump's oil has passed a valve: mean and standard deviation over all of it [1].

    A pressure near a setting may be a heavy load's; one at the setting is held there by the valve. The mean counts from
    the middle of the range on, where the valve is likelier than such a load. The deviation counts from its beginning,
    with the square of the probability for all of it having passed: the setting may be low.
    """
    all_passed = probability**2
    std = ca.sqrt(all_passed * (1.0 - all_passed) + (RELIEF_PUSH_SHARE * all_passed) ** 2)
    return ca.fmax(2.0 * probability - 1.0, 0.0), std


def relief_tolerance(probability: Scalar, tolerance: float) -> Scalar:
    """Share of a pressure by which a valve that opens early may hold it lower than described [1].

    Args:
        probability: that it is open at that pressure, by `relief_probability`.
        tolerance: standard deviation of a setting over it [1].
    """
    return RELIEF_RANGE * tolerance * probability


def relief_probability(z: Vector, speed: Scalar, model: MachineModel) -> Scalar:
    """How likely it is that oil passes one of a circuit's relief valves, 0 to 1.

    It grows with the pressure from where a valve begins to open to its setting, the valve that is nearest counting.
    A pump that draws from a valve's side lets nothing pass there, however much pressure is left from before.

    Args:
        z: the circuit's states.
        speed: of the motor, positive where it extends the piston [rad/s].
        model: of the machine.
    """
    balance, tank = model.balance, model.of_circuit("tank.pressure")
    share: Real = scalar(0.0)
    for part in balance.unit.parts():
        if isinstance(part, ReliefValve):
            inlet, outlet = (balance.pressure(z, node, tank) for node in (part.inlet, part.outlet))
            risen = (inlet - outlet) / model.of_circuit(f"{part.name}.setting")
            near = 1.0 - (1.0 - risen) / (RELIEF_RANGE * model.assumed.machine.relief)
            for way in (1.0, -1.0):
                if not delivers(balance, part.inlet, way):
                    near = ca.if_else(way * speed > 0.0, 0.0, near)
            share = ca.fmax(share, near)
    return within(share, 0.0, 1.0)
