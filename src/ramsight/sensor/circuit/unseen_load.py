"""A load that changes while nothing shows it: how far it may have moved the rod, and how well a load is known."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Condition, Flag, Scalar, all_of, any_of, negated
from ramsight.sensor.circuit.load_step import LoadStep
from ramsight.sensor.inputs.sample import Sample, lasted
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import (
    BETWEEN_STD,
    CERTAIN,
    EFFICIENCY_STD,
    HALF,
    LATEST,
    LATEST_SURE,
    LOAD_FOUND_TIME,
    MEMORY_TIME,
    MOTOR_TURNS,
    TORQUE_OFFSET,
)


@dataclass(frozen=True, kw_only=True)
class UnseenLoadState:
    """Changes of the load at rest."""

    shown_for: Scalar = leaf("s")  # how long the torque has shown the load [s]
    hidden_for: Scalar = leaf("s")  # how long it has not [s]
    load: Scalar = leaf("N")  # that it showed last [N]
    was_seen: Flag = leaf("1")  # whether it ever did
    changes: Scalar = leaf("1")  # mean square of the load changes over the expected one, less 1
    # shakes: mean square of the load's changes from sample to sample, lately, while the torque shows it [N2]
    shakes: Scalar = leaf("N2")


@dataclass(frozen=True)
class UnseenLoad:
    """By how much an unobserved change of the load may have moved the rod; 0 while the load is observed."""

    std: Scalar  # standard deviation [m]
    most: Scalar  # what is exceeded as seldom as the position's bound [m]


def load_std(state: UnseenLoadState, step: LoadStep, expected: Scalar, model: MachineModel) -> Scalar:
    """Standard deviation of the load [N].

    That of the load observer; of the torque's gain and the pumps' efficiency, and of its offset; of the cylinder's
    friction, which is anything between none and twice the described one; what a load that shakes does within a sample;
    and of a change while nothing shows the load.

    Args:
        expected: a load change before any has been observed, standard deviation [N].
    """
    load, gain = step.load, math.hypot(model.assumed.drive.torque_gain, EFFICIENCY_STD)
    offset, friction = TORQUE_OFFSET * model.relief_load, BETWEEN_STD * model.of_circuit("cylinder.coulomb_friction")
    shaken = HALF**2 * state.shakes  # a torque is half a sample old
    hidden = ca.if_else(state.hidden_for > 0.0, expected**2 * ca.fmax(1.0 + state.changes, 0.0), 0.0)
    return ca.sqrt(load.std**2 + (gain * load.value) ** 2 + offset**2 + friction**2 + shaken + hidden)


def unseen_load(
    state: UnseenLoadState,
    sample: Sample,
    step: LoadStep,
    held: Condition,
    expected: Scalar,
    furthest: Scalar,
) -> tuple[UnseenLoadState, UnseenLoad]:
    """What an unobserved change of the load may do to the position.

    The changes observed so far show how large the next one usually is, as well as a dozen of them can, and nothing of a
    rare one: for the bound it is no less than expected at first, and no more than what relief valves carry.

    Args:
        held: whether the piston is held on a stop, where a load does not move it.
        expected: a load change before any has been observed, standard deviation [N].
        furthest: that a load can be from the one observed last [N].
    """
    shows = all_of(step.torque.shows > HALF, ca.fabs(sample.motor_speed) > MOTOR_TURNS)
    shown_for = ca.if_else(shows, state.shown_for + sample.elapsed, 0.0)
    sees = lasted(shown_for, LOAD_FOUND_TIME)
    learns = all_of(all_of(sees, negated(lasted(state.shown_for, LOAD_FOUND_TIME))), state.was_seen)
    mean_square = 1.0 + state.changes
    # The rule of succession: of one more change than the mean has, 2 / gain - 1, one may be as large as described.
    newest = ((step.load.value - state.load) / expected) ** 2 + 0.5 * LATEST
    learnt = mean_square + ca.if_else(learns, LATEST * (newest - mean_square), 0.0)
    unseen = negated(any_of(sees, held))
    usual = expected * ca.sqrt(ca.fmax(learnt, 0.0))
    most = ca.fmin(CERTAIN * ca.fmax(usual, expected), furthest)
    newest_share = ca.fmin(sample.elapsed / MEMORY_TIME, 1.0)
    shaken = newest_share * ((step.load.value - state.load) ** 2 - state.shakes)
    give = step.motion.give_alone
    after = UnseenLoadState(
        shown_for=shown_for,
        hidden_for=ca.if_else(sees, 0.0, state.hidden_for + sample.elapsed),
        load=ca.if_else(sees, step.load.value, state.load),
        was_seen=any_of(state.was_seen, sees),
        changes=learnt - 1.0,
        shakes=state.shakes + ca.if_else(all_of(sees, lasted(state.shown_for, LOAD_FOUND_TIME)), shaken, 0.0),
    )
    found = UnseenLoad(ca.if_else(unseen, give * LATEST_SURE * usual, 0.0), ca.if_else(unseen, give * most, 0.0))
    return after, found
