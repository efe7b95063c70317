"""Contacts: the piston stands while the pump delivers.

A stop, the ground or an obstacle shows mostly in one way: oil is delivered, and all of it is compressed. The position
by the load observer stands then, whatever the pressure is, while it would have gone on at constant load:

    |sum(free travel)| > 30 sigma   while   |sum(travel)| < 4 sigma + 15 % of that sum

with sigma of the position by the torque's noise. From there on the piston is *held*: oil may pass the relief valve or
be drawn from the tank, and none of it moves the piston. Where the contact is, is decided elsewhere (`bank`).

A machine that is softer than described seems to go on by more than that. Near an end the share is twice the standard
deviation of the compliance, once the load has changed by more than loads usually do, or nears the relief valve's.

Where the other chamber has no pump of its own the lowered end shows otherwise: no pressure is left anywhere, and the
pump draws from the tank.

While the motor stands, a load that is taken off looks like a contact for a moment: the oil's force sinks, and the
piston stands. A contact found at rest holds the piston at once, but is evidence of a place only when the torque has
sunk as that of a closed volume does, nearly to nothing, or rises so once the motor pushes. A load that falls while it
is lowered looks like that as well. A motor that still brakes is driven by a load that no stop carries, so such a
contact is evidence only once the motor drives the pump.

`contact_release` decides when a held piston is released.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.expression import Condition, Flag, Real, Scalar, all_of, any_of, count, flag, negated, within
from ramsight.sensor.contact_release import Grip, Holding, look_for_release
from ramsight.sensor.contact_state import (
    Contact,
    ContactPlace,
    ContactState,
    Estimated,
    Hold,
    PendingState,
    SettlingState,
    StandingState,
)
from ramsight.sensor.load_step import LoadStep
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.mode import HELD, Mode, is_in, next_mode
from ramsight.sensor.pressing import Pushed, follow_press
from ramsight.sensor.quantity import Quantity, Row
from ramsight.sensor.sample import Sample
from ramsight.sensor.thresholds import (
    COMPLIANCE_GATE,
    COMPLIANCE_USUAL,
    CONTACT_EVIDENCE,
    CONTACT_SLIP,
    CONTACT_SLIP_UNKNOWN,
    CONTACT_STILL,
    DIRECTION_TRAVEL,
    LOAD_FOUND_TIME,
    LOAD_GONE_NOISE,
    LOAD_GONE_SHARE,
    LOAD_LEFT_SHARE,
    LOAD_MEMORY,
    MOTOR_TURNS,
    NEAR_END,
    NEAR_END_LEAST,
    RARE_LOAD_CHANGE,
    RELIEF_CERTAIN,
    RISE_EVIDENCE,
    SEPARATE_CONTACTS,
    SETTLING_STD_SHARE,
    SHOWN_SHARE,
    VOLUME_MODEL_STD,
)


@dataclass(frozen=True)
class _Standing:
    """Whether a piston stands while oil is delivered.

    Attributes:
        keeps: whether what was delivered still counts.
        stands: whether it may stand.
        surely: whether it does.
        position: where it came to stand [m].
        by: derivatives of what it seemed to move since.
        state: after the sample, but for what was delivered.
    """

    keeps: Flag
    stands: Flag
    surely: Flag
    position: Scalar
    by: Mapping[Quantity, Scalar]
    state: StandingState


@dataclass(frozen=True)
class _Motor:
    """The motor at a sample.

    Attributes:
        turns: whether it turns.
        drives: whether it turns and drives its pump (`motor_drives`).
        since: how long it turns, or stands [s].
        way: in which the piston was delivered oil, +1 for extension.
        free: whether time passes, the load has been found and nothing holds the piston.
        delivered: travel at constant load since the piston may stand [m].
        before: position before the sample [m].
    """

    turns: Flag
    drives: Flag
    since: Scalar
    way: Scalar
    free: Flag
    delivered: Scalar
    before: Scalar


@dataclass(frozen=True)
class _Found:
    """A contact at a sample.

    Attributes:
        standing: whether the piston stands.
        in_vain: whether it surely does while oil is delivered.
        sunk: whether its load has settled on something else.
        contact: whether a contact is found.
        leaving: whether it is with the end that the piston is about to leave.
        settled: where a load that settles came to stand [m].
        settling: state of that after the sample.
        came: way that the piston moved last [m].
    """

    standing: _Standing
    in_vain: Flag
    sunk: Flag
    contact: Flag
    leaving: Flag
    settled: Scalar
    settling: SettlingState
    came: Scalar


def look_for_contact(
    state: ContactState, sample: Sample, step: LoadStep, now: Estimated, travel_by: Row, model: MachineModel
) -> tuple[ContactState, Contact]:
    """One sample.

    Args:
        state: before it.
        sample: with the speed that is used.
        step: of the load observer.
        now: what is estimated of the piston after it.
        travel_by: derivatives of the step's travel with respect to what it is made with.
        model: of the machine.

    Returns:
        The state after the sample, positions in it as before all measurements (`moved`), and the contact.
    """
    motor = _motor(state, sample, step, now, model)
    found = _find(state, sample, step, now, motor, travel_by, model)
    turns, way, contact, leaving = motor.turns, motor.way, found.contact, found.leaving
    holds, off = all_of(contact, negated(leaving)), all_of(contact, leaving)
    # At rest only leakage takes its oil away, and no end releases by that: what the end carries goes with it.
    pulled, stays = all_of(off, turns), all_of(off, negated(turns))
    holding = Holding(
        held=state.held,
        direction=state.direction,
        turns=turns,
        keeps_load=any_of(found.standing.keeps, any_of(state.held, contact)),
        from_rest=stays,
        relief_tolerance=now.relief_tolerance,
        compliance_std=ca.fmax(now.compliance_std, VOLUME_MODEL_STD),
    )
    release, grip = look_for_release(state.release, sample, step, holding, model)
    pushed = Pushed(state.held, grip.pushing, grip.rise, grip.missing, now.compliance, now.compliance_std)
    mode = _mode(state, sample, step, now, grip, motor, holds, pulled, stays)
    leaves = any_of(grip.released, pulled)
    went_on = all_of(grip.released, turns, way == state.direction)
    separate, gone = _separate(state, contact, step, now, grip, went_on, model)
    later = all_of(separate, negated(motor.drives))
    pending, shows = _pending(state, sample, step, motor, contact, later, grip)
    at_top = all_of(leaving, way < 0.0)
    otherwise = any_of(all_of(shows, state.direction > 0.0), all_of(negated(shows), way > 0.0))
    at_top = any_of(at_top, all_of(negated(leaving), otherwise))
    stood_at, std, by, by_way = _stood_at(state, found, motor, model)
    after = ContactState(
        mode=mode,
        turned=turns,
        since=motor.since,
        left_from=state.left_from,
        leaves_way=ca.if_else(grip.back, way, ca.if_else(leaves, 0.0, state.leaves_way)),
        held_at=state.held_at,
        went_on=any_of(went_on, all_of(state.went_on, negated(any_of(contact, grip.released)))),
        gone=gone,
        came=found.came,
        standing=found.standing.state,
        settling=found.settling,
        pending=pending,
        release=release,
        press=follow_press(state.press, pushed),
    )
    place = ContactPlace(
        found=contact,
        evidence=any_of(all_of(separate, negated(later)), shows),
        position=ca.if_else(shows, now.position, stood_at),
        by=by,
        went_on=all_of(pulled, by_way),
        std=std,
        at_top=at_top,
    )
    hold = Hold(
        held=is_in(mode, HELD),
        leaves=leaves,
        released=grip.released,
        went_on=went_on,
        went_back=all_of(grip.released, turns, way != state.direction),
        press=state.press,
        stands=found.standing.stands,
        pushing=grip.pushing,
        draws=all_of(grip.back, is_in(mode, HELD)),
        give_back=grip.pressed / model.stop_stiffness,
        went=grip.went,
        shown=grip.shown,
        travel_std=grip.travel_std,
    )
    return after, Contact(place, hold, mode)


def _motor(state: ContactState, sample: Sample, step: LoadStep, now: Estimated, model: MachineModel) -> _Motor:
    """What the motor does, and what it delivered."""
    speed, moves = sample.extending_speed, sample.elapsed > 0.0
    turns = all_of(ca.fabs(speed) > MOTOR_TURNS, moves)
    # A load that has changed at rest is found in the first moments; the piston seems to stand meanwhile.
    since = ca.if_else(count(turns) == count(state.turned), state.since + sample.elapsed, 0.0)
    free = all_of(since > LOAD_FOUND_TIME, negated(any_of(state.held, state.leaves)))
    delivered = state.standing.delivered + step.motion.free_travel  # also by leakage, where the pump holds the load
    way = ca.if_else(turns, ca.sign(speed), ca.sign(delivered))
    before = now.position - step.motion.travel  # where this sample went is as uncertain as the flow
    drives = all_of(turns, motor_drives(sample, model))
    return _Motor(turns, drives, since, way, all_of(moves, free), delivered, before)


def _find(
    state: ContactState,
    sample: Sample,
    step: LoadStep,
    now: Estimated,
    motor: _Motor,
    travel_by: Row,
    model: MachineModel,
) -> _Found:
    """Whether the piston has come to stand on something, and whether that is an end that it leaves."""
    stops, turns, way = model.assumed.stops, motor.turns, motor.way
    low, top = stops.retracted, model.stroke - stops.extended
    near = NEAR_END * now.std + NEAR_END_LEAST * model.stroke
    ahead = ca.if_else(way > 0.0, top - motor.before, motor.before - low)
    at_end = all_of(now.known, ahead < near)
    standing = _standing(state.standing, sample, step, now, motor, at_end, travel_by)
    # Of a load that only resists nothing but the relief valve's pressure shows an end.
    in_vain = flag(False) if model.passive else standing.surely
    # Oil that is drawn from the tank moves nothing: the load has settled on something else.
    lowers = all_of(turns, way == -model.lift)
    sinks = all_of(step.load.empty, all_of(motor.free, lowers))
    settled, settling = _settling(state.settling, sample, step, motor.before, sinks)
    # At an end a relief valve soon takes all that the pump delivers; nowhere else is that sure.
    over = all_of(all_of(turns, now.relief > RELIEF_CERTAIN), all_of(at_end, negated(state.held)))
    sunk = all_of(sinks, state.settling.empty)
    contact = any_of(in_vain, any_of(sunk, over))
    # Oil that decompresses at an end: a piston that has come there is about to leave.
    position = standing.position
    behind = ca.if_else(way > 0.0, position - low, top - position)
    nearer = behind < top - low - behind
    leaving = all_of(all_of(now.known, nearer), behind < near)
    most = DIRECTION_TRAVEL * model.stroke
    came = within(state.came + step.motion.travel, -most, most)
    leaving = all_of(leaving, state.came * way < 0.0)
    counts = all_of(standing.keeps, negated(contact))
    kept = replace(standing.state, delivered=ca.if_else(counts, motor.delivered, 0.0))
    return _Found(replace(standing, state=kept), in_vain, sunk, contact, leaving, settled, settling, came)


def _standing(
    state: StandingState,
    sample: Sample,
    step: LoadStep,
    now: Estimated,
    motor: _Motor,
    at_end: Flag,
    travel_by: Row,
) -> _Standing:
    """Whether the piston stands while oil is delivered.

    By its way and not by its place, which references and the cylinder's ends move.
    """
    sigma, delivered = step.motion.noise, motor.delivered
    seems = state.moved + step.motion.travel
    softer = within(COMPLIANCE_GATE * now.compliance_std, CONTACT_SLIP, CONTACT_SLIP_UNKNOWN)
    slips = ca.if_else(now.known, ca.if_else(at_end, softer, CONTACT_SLIP), CONTACT_SLIP_UNKNOWN)

    def still(share: Real) -> Flag:
        return ca.fabs(seems) < CONTACT_STILL * sigma + share * ca.fabs(delivered)

    stands = all_of(motor.free, still(slips))
    # A mass that bounces on its oil stands for half a period at most.
    stood = state.since + sample.elapsed
    in_vain = all_of(all_of(stands, stood > step.motion.bounce), ca.fabs(delivered) > CONTACT_EVIDENCE * sigma)
    # A load that only grows takes some of the oil as well; it neither doubles nor comes near the relief valve's.
    changed = ca.fabs(delivered - seems) > RARE_LOAD_CHANGE * now.load_change_std * step.motion.give
    rare = any_of(now.relief > 0.0, changed)
    evident = any_of(still(CONTACT_SLIP), rare)
    keeps = any_of(stands, negated(sample.elapsed > 0.0))
    by = {one: value + travel_by[one] for one, value in state.moved_by.items()}
    after = StandingState(
        since=ca.if_else(stands, stood, 0.0),
        moved=ca.if_else(keeps, seems, 0.0),
        moved_by={one: ca.if_else(keeps, value, 0.0) for one, value in by.items()},
        delivered=state.delivered,
    )
    return _Standing(keeps, stands, all_of(in_vain, evident), now.position - seems, by, after)


def _settling(
    state: SettlingState, sample: Sample, step: LoadStep, before: Scalar, sinks: Flag
) -> tuple[Scalar, SettlingState]:
    """Where the piston was when the pump's side last carried what it had carried before [m].

    A load that settles on something else leaves the oil; while the oil decompresses the pump still delivers and the
    piston seems to go on.
    """
    carries = ca.fabs(step.load.carried)
    carried = ca.fmax(carries, state.carried * ca.exp(-sample.elapsed / LOAD_MEMORY))
    position = ca.if_else(carries < LOAD_LEFT_SHARE * carried, state.position, before)
    return position, SettlingState(empty=sinks, carried=carried, position=position)


def _stood_at(
    state: ContactState, found: _Found, motor: _Motor, model: MachineModel
) -> tuple[Scalar, Scalar, dict[Quantity, Scalar], Flag]:
    """Where a piston stood [m], standard deviation of that [m], derivatives of its way since, whether it has one."""
    # Where it is again before it was away, it was held before; the stop that gave way meanwhile does so once more.
    again = ca.if_else(state.leaves, state.held_at, motor.before)
    # Where no oil gives it a force, nothing shows where it stands since.
    drained = any_of(found.sunk, is_in(state.mode, (Mode.EMPTY,)))
    # Held again soon after it seemed to go on: whether it had moved meanwhile is unknown.
    soon = ca.fabs(motor.before - state.held_at) < SEPARATE_CONTACTS * model.stroke
    unmoved = all_of(state.went_on, soon, negated(state.leaves))
    stood_at = ca.if_else(drained, found.settled, ca.if_else(found.in_vain, found.standing.position, again))
    settling = SETTLING_STD_SHARE * (motor.before - found.settled)
    std = ca.if_else(drained, settling, ca.if_else(unmoved, stood_at - state.held_at, 0.0))
    by_way = all_of(found.in_vain, negated(drained))
    return stood_at, std, {one: ca.if_else(by_way, by, 0.0) for one, by in found.standing.by.items()}, by_way


def _mode(
    state: ContactState,
    sample: Sample,
    step: LoadStep,
    now: Estimated,
    grip: Grip,
    motor: _Motor,
    holds: Flag,
    pulled: Flag,
    stays: Flag,
) -> Scalar:
    """What the piston does after the sample."""
    way = motor.way
    away = ca.fabs(now.position - state.left_from) > CONTACT_EVIDENCE * step.motion.noise
    conditions: dict[str, Condition] = {
        "stopped while it retracts": any_of(all_of(holds, way < 0.0), all_of(stays, way > 0.0)),
        "stopped while it extends": any_of(all_of(holds, way >= 0.0), all_of(stays, way <= 0.0)),
        "pulled off an end": pulled,
        "released": grip.released,
        "not yet away": negated(away),
        "no force": step.load.empty,
        "relief valve open": now.relief > 0.0,
        "motor turns": motor.turns,
        "torque shows the load": step.torque.shows > SHOWN_SHARE,
    }
    return next_mode(state.mode, conditions)


def _separate(
    state: ContactState,
    contact: Flag,
    step: LoadStep,
    now: Estimated,
    grip: Grip,
    went_on: Flag,
    model: MachineModel,
) -> tuple[Flag, Scalar]:
    """Whether a contact is another one than the last, and the share of the stroke moved since the last one.

    It is where the piston moved in between, where its position was unknown, and after one that turned out to be none.
    """
    was_none = any_of(all_of(state.pending.waits, grip.released), went_on)
    gone = state.gone + ca.fabs(step.motion.travel) / model.stroke
    gone = ca.if_else(was_none, SEPARATE_CONTACTS, gone)
    separate = all_of(contact, any_of(gone >= SEPARATE_CONTACTS, negated(now.known)))
    return separate, ca.if_else(contact, 0.0, ca.fmin(gone, SEPARATE_CONTACTS))


def _pending(
    state: ContactState, sample: Sample, step: LoadStep, motor: _Motor, contact: Flag, later: Flag, grip: Grip
) -> tuple[PendingState, Flag]:
    """A contact that waits, and whether it is evidence of a place now; one that was released before never is.

    One found at rest is when the torque of the held piston has gone as that of a closed volume does, one found by a
    motor that brakes when the motor drives the pump.
    """
    gone = torque_gone(step, sample.motor_torque, grip.rests, state.pending.torque)
    turned = all_of(any_of(state.pending.turned, contact), motor.turns)
    builds = any_of(state.pending.turned, torque_builds(step, grip.rise, grip.missing))
    follows = any_of(gone, all_of(grip.pushing, motor.drives, builds))
    waits, released = state.pending.waits, grip.released
    shows = all_of(waits, all_of(follows, negated(released)))
    still = all_of(waits, negated(any_of(released, shows)))
    after = PendingState(
        waits=any_of(all_of(contact, later), all_of(negated(contact), still)),
        turned=turned,
        torque=ca.if_else(contact, step.torque.expected, state.pending.torque),
    )
    return after, shows


def torque_gone(step: LoadStep, torque: Scalar, rests: Flag, found_with: Scalar) -> Flag:
    """Whether the torque of a piston held at rest has gone, the expected one and the reported one.

    Args:
        step: of the load observer.
        torque: reported [N m].
        rests: whether the piston is held at rest.
        found_with: torque when the contact was found [N m].
    """
    left = ca.fmax(ca.fabs(step.torque.expected), ca.fabs(torque))
    least = ca.fmax(LOAD_GONE_SHARE * ca.fabs(found_with), LOAD_GONE_NOISE * step.torque.noise)
    return all_of(rests, left < least)


def motor_drives(sample: Sample, model: MachineModel) -> Flag:
    """Whether a motor that turns drives its pump; one that brakes is driven by a load that nothing else carries.

    Args:
        sample: its torque and its speed.
        model: of the machine.
    """
    return sample.motor_torque * ca.sign(sample.motor_speed) > -LOAD_GONE_NOISE * model.torque_std


def torque_builds(step: LoadStep, built: Scalar, missing: Scalar) -> Flag:
    """Whether the torque of a motor that pushes rises as a closed volume lets it.

    Args:
        step: of the load observer.
        built: rise of the expected torque [N m].
        missing: what the reported one stays behind [N m].
    """
    return all_of(built > RISE_EVIDENCE * step.torque.noise, missing < COMPLIANCE_USUAL * built)
