"""When a piston that is held is released.

When the motor turns back, the stop holds the piston until its oil has decompressed to the load that it carried before,
or the oil on the other side is compressed as far; sooner, when the torque changes less than that of a closed volume,
and neither compliance nor noise explains that; at the latest when several times as much oil has been drawn as
compliance gives back. Meanwhile the torque shows the compliance.

When the motor goes on pushing, the piston is released where the torque stays behind that of a closed volume, and
neither its compliance nor a relief valve that opens early explains that. However soft a closed volume is, it has the
pressure of the relief valve once it has got as much more oil as it is softer. Then it may not have been held since the
torque stays behind: it may have moved as far as the pump delivered, less what leaked before, and no farther than the
oil gives way by what the torque stays behind. Its oil was compressed no more than the torque shows, and what it gave
way by then is travel (`load_release`).

Where the pump holds the load, the piston also leaves a stop at rest: leakage lets the oil's force sink below the load
that it carried before, or the torque stays at that load while a closed volume would lose it:

    released at rest when |change expected - change shown| > 4 sigma + 0.5 |change expected|
"""

from __future__ import annotations

from dataclasses import dataclass, field

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Real, Scalar, all_of, any_of, negated, scalar
from ramsight.sensor.circuit.load_step import LoadStep
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import (
    COMPLIANCE_FACTOR_MOST,
    HALF,
    MEMORY_TIME,
    SHORTEST_STEP,
    SURE_STDS,
    TINY,
    USUAL_STDS,
)


@dataclass(frozen=True, kw_only=True)
class RestState:
    """A piston that is held at rest."""

    held: Flag = leaf("1")  # whether it was at the last sample
    expected_began: Scalar = leaf("N m")  # expected torque when that began [N m]
    shown_began: Scalar = leaf("N m")  # reported torque then [N m]
    least_behind: Scalar = leaf("N m")  # how far the reported torque stayed behind least since [N m]
    sunk: Scalar = leaf("m")  # way that explains how far it stays behind [m]


@dataclass(frozen=True, kw_only=True)
class ReleaseState:
    """A piston that may be released."""

    pushing_began: Scalar = leaf("N m")  # expected torque when the motor began to push [N m]
    load_least: Scalar = leaf("N")  # least load lately, before the piston stood [N]
    load_largest: Scalar = leaf("N")  # largest load lately, before it stood [N]
    drawn_back: Scalar = leaf("m")  # way by what the pump has drawn since the motor turns back [m]
    pressed_before: Scalar = leaf("N")  # force on what holds it before that [N]
    back_largest: Scalar = leaf("N m")  # largest torque since the motor turns back [N m]
    back_least: Scalar = leaf("N m")  # least torque since [N m]
    leakage: Scalar = leaf("m/s")  # velocity by leakage, before the piston stood [m/s]
    pushed_in_vain: Scalar = leaf("m")  # way by what the pump has delivered since the torque stays behind [m]
    delivered: Scalar = leaf("m")  # way by what it has delivered at least since the motor pushes [m]
    filled: Scalar = leaf("m")  # the same, until a relief valve might open [m]
    built: Scalar = leaf("N m")  # change of the expected torque until then [N m]
    rest: RestState = field(default_factory=RestState)  # the piston held at rest


@dataclass(frozen=True)
class Holding:
    """The piston before a sample, and what a contact stage knows of it."""

    held: Flag  # whether it is held
    direction: Scalar  # in which it cannot go on then, +1 for extension
    turns: Flag  # whether the motor turns
    keeps_load: Flag  # whether the load from before is kept: the piston stands, or is held
    relief_tolerance: Real  # share of a pressure by which a relief valve may hold it lower than described [1]
    compliance_std: Scalar  # standard deviation of the compliance [1]


@dataclass(frozen=True)
class Grip:
    """What holds a piston, at a sample."""

    rests: Flag  # whether it is held while the motor stands
    pushing: Flag  # whether the motor pushes against what holds it
    back: Flag  # whether the motor turns back
    released: Flag  # whether the piston is released
    pressed: Scalar  # force of the oil beside the load from before, in the direction of extension [N]
    rise: Scalar  # change of the expected torque since the motor pushes, in its direction [N m]
    missing: Scalar  # what the reported torque stays behind that [N m]
    went: Scalar  # way that a piston which is released may have moved while it seemed held [m]
    shown: Scalar  # share of what its oil did while it was held that the torque shows [1]; of a piston just released
    travel_std: Scalar  # standard deviation of the way that it may have moved while the motor turns back, or stands [m]


@dataclass(frozen=True)
class _Drawn:
    """The torque of a held piston while the motor turns back."""

    behind: Flag  # whether it changes less than that of a closed volume
    surely: Flag  # whether compliance and noise do not explain that: the piston moves
    # largest, least: torque since the motor turns back [N m]
    largest: Scalar
    least: Scalar
    most_behind: Scalar  # how far it stays behind, and by how much more the compliance may hide [N m]


@dataclass(frozen=True)
class _AtRest:
    """Changes of the torque of a piston held at rest, since that began [N m]."""

    expected: Scalar
    shown: Scalar
    state: RestState
    sunk: Scalar


def look_for_release(
    state: ReleaseState, sample: Sample, step: LoadStep, piston: Holding, model: MachineModel
) -> tuple[ReleaseState, Grip]:
    """Whether a held piston is released."""
    held, direction, turns = piston.held, piston.direction, piston.turns
    same_way = ca.sign(sample.extending_speed) == direction
    rests = all_of(held, all_of(negated(turns), sample.elapsed > 0.0))
    pushing = all_of(held, all_of(turns, same_way))
    back = all_of(held, all_of(turns, negated(same_way)))
    load_least, load_largest, load_before = _load_before(state, sample, step, piston, model)
    pressed = model.lift * (step.load.carried - load_before)
    friction = model.of_circuit("cylinder.coulomb_friction")
    sunk_at_rest = all_of(rests, pressed * direction < -friction)
    built = step.torque.expected - state.pushing_began
    sense = direction * sample.way  # sign of the torque that pushes
    missing, rise = -step.torque.innovation * sense, built * sense
    compliance, delivered = piston.compliance_std, ca.if_else(pushing, _delivered(state, sample, model), 0.0)
    over = missing - SURE_STDS * step.torque.noise - piston.relief_tolerance * ca.fabs(step.torque.expected)
    shut = piston.relief_tolerance <= 0.0
    filled, built_shut = (
        ca.if_else(pushing, ca.if_else(shut, now, before), 0.0)
        for now, before in ((delivered, state.filled), (ca.fabs(built), state.built))
    )
    # However soft it is, a volume has all of its pressure once it has got as much more oil.
    full = delivered * built_shut > (1.0 + SURE_STDS * compliance) * filled * ca.fabs(built)
    yields = all_of(pushing, over > 0.0, any_of(over > USUAL_STDS * compliance * ca.fabs(built), full))
    drawn = _drawn(state, step, back, compliance)
    behind = any_of(all_of(pushing, missing > compliance * rise), all_of(back, drawn.behind))
    most_behind = ca.if_else(pushing, missing + compliance * rise, drawn.most_behind)
    leakage, pushed = _moved_in_vain(state, sample, step, any_of(piston.keeps_load, negated(turns)), model)
    rest = _at_rest(state.rest, sample, step, rests, back, model)
    stays = all_of(rests, torque_stays(step, rest.expected, rest.shown))
    pumped = ca.fabs(sample.extending_angle) * model.travel_per_radian
    oil_back = ca.if_else(back, state.drawn_back + pumped, 0.0)
    towards = pressed * direction
    pressed_before = ca.if_else(back, state.pressed_before, ca.fabs(towards))
    most_drawn = oil_back > 2.0 * COMPLIANCE_FACTOR_MOST * step.motion.give * state.pressed_before
    leaves = all_of(back, any_of(drawn.surely, any_of(towards < -friction, most_drawn)))
    released = any_of(any_of(leaves, sunk_at_rest), any_of(yields, stays))
    # Of a piston that was pressed on it before, the torque has long shown that; what it stays behind is a part of all.
    built_up = ca.fmax(rise, ca.fabs(pressed) * model.travel_per_radian)
    shown = ca.if_else(yields, _share(built_up - missing, built_up), 1.0)
    shown = ca.if_else(stays, _share(rest.shown, rest.expected), shown)
    after = ReleaseState(
        pushing_began=ca.if_else(pushing, state.pushing_began, step.torque.expected),
        load_least=load_least,
        load_largest=load_largest,
        drawn_back=oil_back,
        pressed_before=pressed_before,
        back_largest=drawn.largest,
        back_least=drawn.least,
        leakage=leakage,
        pushed_in_vain=ca.if_else(behind, pushed, 0.0),
        delivered=delivered,
        filled=filled,
        built=built_shut,
        rest=rest.state,
    )
    grip = Grip(
        rests=rests,
        pushing=pushing,
        back=back,
        released=released,
        pressed=pressed,
        rise=rise,
        missing=missing,
        went=ca.if_else(any_of(yields, leaves), way_gone(pushed, most_behind, step, model), 0.0),
        shown=shown,
        travel_std=rest.sunk + compliance * oil_back,
    )
    return after, grip


def _drawn(state: ReleaseState, step: LoadStep, back: Flag, compliance: Scalar) -> _Drawn:
    """Whether a piston moves with a motor that turns back, by a torque that changes less than a closed volume's.

    The oil on the stop's side decompresses, or the one on the other side is compressed; either way the torque changes
    until the piston leaves the stop. While a valve that holds the load opens, that comes a little sooner or later; so
    the change counts from the largest, or the least torque.
    """
    torque, noise = step.torque.expected, SURE_STDS * step.torque.noise
    behind, surely, extremes, most = [], [], [], scalar(0.0)
    for extreme, sign in ((state.back_largest, 1.0), (state.back_least, -1.0)):
        now = ca.if_else(back, ca.fmax(sign * extreme, sign * torque), sign * torque)
        changed, left = now - sign * torque, sign * step.torque.innovation
        behind.append(left > compliance * changed)
        surely.append(all_of(changed > noise, left > noise + USUAL_STDS * compliance * changed))
        extremes.append(sign * now)
        most = ca.fmax(most, left + compliance * changed)
    largest, least = extremes
    return _Drawn(any_of(*behind), any_of(*surely), largest, least, most)


def _moved_in_vain(
    state: ReleaseState, sample: Sample, step: LoadStep, keeps: Flag, model: MachineModel
) -> tuple[Scalar, Scalar]:
    """Velocity by leakage before the piston stood [m/s], and the way that the pump delivered beyond that [m]."""
    pumped = sample.extending_angle * model.travel_per_radian
    newest = (pumped - step.motion.free_travel) / ca.fmax(sample.elapsed, SHORTEST_STEP)
    share = ca.fmin(sample.elapsed / MEMORY_TIME, 1.0)
    leakage = ca.if_else(keeps, state.leakage, state.leakage + share * (newest - state.leakage))
    pushed = state.pushed_in_vain + pumped - state.leakage * sample.elapsed
    return leakage, pushed


def _delivered(state: ReleaseState, sample: Sample, model: MachineModel) -> Scalar:
    """Way by what the pump has delivered since the motor pushes, less what may leak at relief pressure [m]."""
    most = (1.0 + SURE_STDS * model.assumed.machine.leak) * model.thinner(sample.pump_temperature)
    pumped = ca.fabs(sample.extending_angle) * model.travel_per_radian
    return ca.fmax(state.delivered + pumped - most * model.leak_velocity * sample.elapsed, 0.0)


def way_gone(pushed: Scalar, behind: Scalar, step: LoadStep, model: MachineModel) -> Scalar:
    """The longest way that a piston may have gone while it seemed held [m].

    Oil that moves the piston is not compressed: the torque stays behind by as much as the oil gives way on that way.

    Args:
        pushed: way by what the pump has delivered meanwhile [m].
        behind: how far the torque stays behind that of a piston that is held [N m].
    """
    return ca.fmin(ca.fabs(pushed), _given_way(ca.fmax(behind, 0.0) + step.torque.noise, step, model))


def _given_way(torque: Scalar, step: LoadStep, model: MachineModel) -> Scalar:
    """Way that the oil gives by a change of the torque [m]."""
    return torque * step.motion.give / model.travel_per_radian


def _at_rest(state: RestState, sample: Sample, step: LoadStep, rests: Flag, back: Flag, model: MachineModel) -> _AtRest:
    """Changes of the expected torque and of the reported one since a piston is held at rest.

    The changes count: a load that was followed slowly may have been another one when the piston seemed to stand. How
    far the reported torque stays behind is a way that the piston may have sunk, since it went along last.
    """
    goes_on = all_of(rests, state.held)
    expected = ca.if_else(state.held, step.torque.expected - state.expected_began, 0.0)
    shown = ca.if_else(state.held, sample.motor_torque - state.shown_began, 0.0)
    behind = (expected - shown) * ca.sign(expected)
    went_along = ca.if_else(rests, ca.fmin(state.least_behind, behind), 0.0)
    way = _given_way(behind - went_along, step, model)
    sunk = ca.if_else(rests, way, ca.if_else(back, state.sunk, 0.0))
    after = RestState(
        held=rests,
        expected_began=ca.if_else(goes_on, state.expected_began, step.torque.expected),
        shown_began=ca.if_else(goes_on, state.shown_began, sample.motor_torque),
        least_behind=went_along,
        sunk=sunk,
    )
    return _AtRest(expected, shown, after, sunk)


def _load_before(
    state: ReleaseState, sample: Sample, step: LoadStep, piston: Holding, model: MachineModel
) -> tuple[Scalar, Scalar, Scalar]:
    """Least and largest load before the piston stood, and which of them the oil carried [N].

    While the piston comes to stand the load seems to collapse, for what stops it carries it: the largest or the least
    one of the last moments is the one from before.
    """
    load, share = step.load.value, ca.fmin(sample.elapsed / MEMORY_TIME, 1.0)
    share = ca.if_else(sample.started, share, 1.0)
    least = ca.if_else(
        piston.keeps_load, state.load_least, ca.fmin(load, state.load_least + share * (load - state.load_least))
    )
    largest = ca.if_else(
        piston.keeps_load, state.load_largest, ca.fmax(load, state.load_largest + share * (load - state.load_largest))
    )
    before = ca.if_else(piston.direction * model.lift > 0.0, least, largest)
    return least, largest, before


def _share(shown: Scalar, expected: Scalar) -> Scalar:
    """How much of an expected change is there, 0 to 1."""
    some = ca.fmax(shown * ca.sign(expected), 0.0)
    return ca.fmin(some / ca.fmax(ca.fabs(expected), TINY), 1.0)


def torque_stays(step: LoadStep, expected: Scalar, shown: Scalar) -> Flag:
    """Whether the torque stays while that of a piston held at rest would change: it is not held.

    Args:
        expected: change of the expected torque since the piston is held at rest [N m].
        shown: change of the reported one [N m].
    """
    sense, noise = ca.sign(expected), SURE_STDS * step.torque.noise
    stays = (expected - shown) * sense > noise + HALF * ca.fabs(expected)
    return all_of(stays, -step.torque.innovation * sense > noise)
