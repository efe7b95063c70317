"""Oil over a relief valve: near its setting the share of the pump's oil that passes it is uncertain."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca

from ramsight.expression import Real, Scalar, Vector, scalar, within
from ramsight.plant.valve import ReliefValve
from ramsight.sensor.machine_model import MachineModel, delivers
from ramsight.sensor.normal_tail import upper_tail
from ramsight.sensor.thresholds import BETWEEN_STD, RELIEF_RANGE


@dataclass(frozen=True)
class Relief:
    """Oil over a relief valve."""

    probability: Scalar  # that the pump's oil passes one, 0 to 1
    passed_std: Scalar  # standard deviation that the position has gained by it since a reference [m]


def passed_share(probability: Scalar) -> tuple[Scalar, Scalar]:
    """What of the pump's oil has passed a valve: mean and standard deviation over all of it [1].

    A pressure near a setting may be a heavy load's; one at the setting is held there by the valve. The mean counts from
    the middle of the range on, where the valve is likelier than such a load. The deviation counts from its beginning,
    with the square of the probability for all of it having passed: the setting may be low.
    """
    all_passed = probability**2
    std = ca.sqrt(all_passed * (1.0 - all_passed) + (BETWEEN_STD * all_passed) ** 2)
    return ca.fmax(2.0 * probability - 1.0, 0.0), std


@dataclass(frozen=True)
class Blown:
    """Velocity of a piston whose load presses oil over a relief valve [m/s], extension positive."""

    mean: Scalar  # of it
    std: Scalar  # its standard deviation


def blown(z: Vector, speed: Scalar, model: MachineModel) -> Blown:
    """Oil that the load presses over a relief valve, while the pump presses none there.

    The flow q of a valve grows with its pressure p above its setting s. How far above is known to the tolerance of the
    setting, sigma, which is several times what a valve rises by. So with u = (p - s)/sigma and normal errors

        E[q] = k sigma (u Phi(u) + phi(u)),    E[q^2] = (k sigma)^2 ((1 + u^2) Phi(u) + u phi(u)).

    Args:
        speed: of the motor, positive where it extends the piston [rad/s].
    """
    cylinder, tolerance = model.balance.unit.cylinder, model.assumed.machine.relief
    mean, variance = scalar(0.0), scalar(0.0)
    for valve, risen in _valves(z, model):
        above = (risen - 1.0) / tolerance
        below, density = upper_tail(-above), ca.exp(-0.5 * above**2) / math.sqrt(2.0 * math.pi)
        rises = model.of_circuit(f"{valve.name}.conductance") * tolerance * model.of_circuit(f"{valve.name}.setting")
        first = ca.fmax(above * below + density, 0.0)
        second = (1.0 + above**2) * below + above * density
        for way, side in ((1.0, "a"), (-1.0, "b")):
            if delivers(model.balance, valve.inlet, way):
                leaves = speed * way <= 0.0
                per_flow = rises / cylinder.area(side)
                # The circuit's own valve passes what is above its setting.
                mean = mean - ca.if_else(leaves, way * per_flow * (first - ca.fmax(above, 0.0)), 0.0)
                variance = variance + ca.if_else(leaves, per_flow**2 * ca.fmax(second - first**2, 0.0), 0.0)
    return Blown(mean, ca.sqrt(variance))


def _valves(z: Vector, model: MachineModel) -> Iterator[tuple[ReliefValve, Scalar]]:
    """A circuit's relief valves, and the pressure over each as a share of its setting [1]."""
    balance, tank = model.balance, model.of_circuit("tank.pressure")
    for part in balance.unit.parts():
        if isinstance(part, ReliefValve):
            inlet, outlet = (balance.pressure(z, node, tank) for node in (part.inlet, part.outlet))
            yield part, (inlet - outlet) / model.of_circuit(f"{part.name}.setting")


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
        speed: of the motor, positive where it extends the piston [rad/s].
    """
    share: Real = scalar(0.0)
    for valve, risen in _valves(z, model):
        near = 1.0 - (1.0 - risen) / (RELIEF_RANGE * model.assumed.machine.relief)
        for way in (1.0, -1.0):
            if not delivers(model.balance, valve.inlet, way):
                near = ca.if_else(way * speed > 0.0, 0.0, near)
        share = ca.fmax(share, near)
    return within(share, 0.0, 1.0)
