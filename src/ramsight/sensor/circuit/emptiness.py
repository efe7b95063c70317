"""Whether the oil gives the piston a force; where it gives none, nothing in the circuit says where the piston goes.

Where the pump acts on one side only, that is so as soon as there may be no load and the pump does not deliver: a load
that rests on something else leaves the oil, and the pump draws from the tank. One that bounces on its oil comes back
within half a period. How light a load may be follows from its standard deviation, not from a single torque, and from
what no torque tells from a load: pumps with another friction, and where most of the load has just gone or has been gone
since, an offset of the drive's torque. Of a load that stays what it was an offset says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Condition, Real, Scalar, Vector, all_of, flag
from ramsight.machine.linkage import STANDARD_GRAVITY
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import (
    FRICTION_SPREAD,
    LOAD_FALLEN_SHARE,
    MEMORY_TIME,
    NO_PRESSURE,
    SURE_STDS,
    TORQUE_OFFSET,
)


@dataclass(frozen=True, kw_only=True)
class EmptyState:
    """Oil that may give the piston no force, where the pumps act on one side only."""

    since: Scalar = leaf("s")  # how long it may have given none [s]
    carried: Scalar = leaf("N")  # largest load lately, before that [N]


@dataclass(frozen=True)
class Emptiness:
    """What is known of that at a sample."""

    state: EmptyState | None  # after the sample; None where the pumps act on both sides
    share: Real  # how likely the oil gives no force, 0 to 1
    may_be: Condition  # whether it may give none
    surely: Condition  # whether it surely gives none


def emptiness(
    state: EmptyState | None,
    z: Vector,
    load: Scalar,
    variance: Scalar,
    friction: Scalar,
    bounce: Scalar,
    sample: Sample,
    model: MachineModel,
) -> Emptiness:
    """Whether the oil gives the piston a force.

    Args:
        load: estimated [N].
        variance: of it [N2].
        friction: of the pumps, as a torque of the motor [N m].
        bounce: half a period of the load on its oil [s].
    """
    if model.passive:  # a load that only resists keeps the piston where it is
        return Emptiness(None, 0.0, flag(False), flag(False))
    balance = model.balance
    if state is None:
        # A pump that draws from a chamber under pressure meters the piston, whatever the load is.
        cylinder, tank = balance.unit.cylinder, model.of_circuit("tank.pressure")
        drained = [balance.pressure(z, node, tank) < tank + NO_PRESSURE for node in (cylinder.node_a, cylinder.node_b)]
        held = balance.pressure(z, getattr(cylinder, f"node_{balance.unit.held}"), tank) < tank
        least = SURE_STDS * model.assumed.drive.torque * model.relief_load
        empty = all_of(held, *drained, ca.fabs(balance.force(z)) < least)
        return Emptiness(None, 0.0, empty, empty)
    # What it carried is remembered for as long as it may carry none.
    fades = ca.if_else(state.since > 0.0, 1.0, ca.exp(-sample.elapsed / MEMORY_TIME))
    carried = ca.fmax(load, state.carried * fades)
    offset = ca.if_else(load < LOAD_FALLEN_SHARE * carried, TORQUE_OFFSET * model.relief_torque, 0.0)
    persistent2 = ((FRICTION_SPREAD - 1.0) ** 2 * friction**2 + offset**2) / model.travel_per_radian**2
    lightest = SURE_STDS * ca.sqrt(ca.fmax(variance, 0.0) + persistent2)
    none = all_of(load < lightest, model.lift * sample.extending_speed <= 0.0)
    since = ca.if_else(none, state.since + sample.elapsed, 0.0)
    likely = ca.if_else(none, ca.fmin(1.0 - load / ca.fmax(lightest, 1e-3), 1.0), 0.0)
    return Emptiness(EmptyState(since=since, carried=carried), likely, none, since > bounce)


def not_risen(z: Vector, before: Vector, empty: Emptiness, sample: Sample, model: MachineModel) -> tuple[Vector, Real]:
    """States after a sample, of a piston that does not rise where oil may give it no force and the pump delivers none.

    What a torque shows then as a pull is the load's inertia: it has been thrown up, and comes back. A piston without
    mass would follow the pull, and draw oil as fast as it gets any.

    Returns:
        The states, and how high the load may fly as the pump stops [m]: v^2/(2 g).
    """
    if empty.state is None:
        return z, 0.0
    stands = all_of(empty.may_be, model.lift * (z[0] - before[0]) > 0.0)
    still = ca.vertcat(before[0], 0.0, z[2:])
    thrown = ca.fmax(model.lift * sample.last_extending_speed, 0.0) * model.travel_per_radian
    return ca.if_else(stands, still, z), ca.if_else(stands, thrown**2 / (2.0 * STANDARD_GRAVITY), 0.0)
