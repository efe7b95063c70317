"""Contacts: the piston stands while the pump delivers, until it is known on what.

A stop, the ground, an obstacle or a load that rises shows in one way: oil is delivered, and all of it is compressed.
The position by the load observer stands then, whatever the pressure is. At constant load it would have gone on:

    |sum(free travel)| > 30 sigma   while   |sum(travel)| < 4 sigma + 15 % of that sum

with sigma of the position by the torque's noise. From there on the piston is *held*: oil may pass the relief valve or
be drawn from the tank, and none of it moves the piston. A contact says nothing of a place yet. It *waits* until the
press has decided (`press`): only an end holds the relief valve's pressure for long. A contact that is released before
that teaches nothing, neither of a place nor of the oil.

A machine that is softer than described seems to go on by more than 15 %. Near an end the share is twice the standard
deviation of the compliance, once the load has changed by more than loads usually do, or nears the relief valve's. A
valve that opens early passes the pump's oil before the piston stands by its balance: at an end the piston is held once
the pressure has been where the valve may open for longer than a load is.

Where the other chamber has no pump of its own the lowered end shows otherwise: no pressure is left anywhere, and the
pump draws from the tank. That is evidence of the place by itself.

`contact_release` decides when a held piston is released; where a contact is, the hypotheses decide (`bank`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca

from ramsight.expression import Condition, Flag, Real, Scalar, all_of, any_of, count, flag, negated, within
from ramsight.sensor.circuit.load_step import LoadStep
from ramsight.sensor.contacts.contact_release import Grip, Holding, look_for_release
from ramsight.sensor.contacts.contact_state import (
    Contact,
    ContactPlace,
    ContactState,
    Estimated,
    Hold,
    NearSettingState,
    SettlingState,
    StandingState,
)
from ramsight.sensor.contacts.mode import HELD, Mode, is_in, next_mode
from ramsight.sensor.contacts.press import Pushed, at_setting, follow_press, likelier_at_end
from ramsight.sensor.inputs.sample import Sample, lasted
from ramsight.sensor.machine_model import MachineModel, one_sided
from ramsight.sensor.thresholds import (
    CONTACT_EVIDENCE,
    CONTACT_SLIP,
    CONTACT_SLIP_UNKNOWN,
    END_GIVES,
    HALF,
    LOAD_FALLEN_SHARE,
    LOAD_FOUND_TIME,
    MEMORY_TIME,
    MOTOR_TURNS,
    NEAR_END_SHARE,
    OUTSIDE,
    SEPARATE_CONTACTS,
    SETTLING_STD_SHARE,
    SURE_STDS,
    USUAL_STDS,
    VALVE_SETTLED,
    VOLUME_MODEL_STD,
)


@dataclass(frozen=True)
class _Motor:
    """The motor at a sample."""

    turns: Flag  # whether it turns
    since: Scalar  # how long it turns, or stands [s]
    way: Scalar  # in which the piston was delivered oil, +1 for extension
    free: Flag  # whether time passes, the load has been found and nothing holds the piston
    delivered: Scalar  # travel at constant load since the piston may stand [m]
    before: Scalar  # position before the sample [m]


@dataclass(frozen=True)
class _Standing:
    """Whether a piston stands while oil is delivered."""

    keeps: Flag  # whether what was delivered still counts
    stands: Flag  # whether it may stand
    surely: Flag  # whether it does
    position: Scalar  # where it came to stand [m]
    state: StandingState  # after the sample, but for what was delivered


@dataclass(frozen=True)
class _Found:
    """A contact at a sample."""

    contact: Flag  # whether one is found
    sunk: Flag  # whether it is a load that has settled on something else
    standing: _Standing  # whether the piston stands
    position: Scalar  # where it came to stand [m]
    std: Scalar  # standard deviation of that where only the oil's pressure shows it [m]
    # near_setting, settling: states after the sample
    near_setting: NearSettingState
    settling: SettlingState
    came: Scalar  # way that the piston moved last [m]


def look_for_contact(
    state: ContactState, sample: Sample, step: LoadStep, now: Estimated, model: MachineModel
) -> tuple[ContactState, Contact]:
    """One sample.

    Returns:
        The state after the sample, positions in it as before all measurements (`moved`), and the contact.
    """
    motor = _motor(state, sample, step, now)
    found = _find(state, sample, step, now, motor, model)
    contact, way = found.contact, motor.way
    holding = Holding(
        held=state.held,
        direction=state.direction,
        turns=motor.turns,
        keeps_load=any_of(found.standing.keeps, any_of(state.held, contact)),
        relief_tolerance=now.relief_tolerance,
        compliance_std=ca.fmax(now.compliance_std, VOLUME_MODEL_STD),
    )
    release, grip = look_for_release(state.release, sample, step, holding, model)
    press, decided = follow_press(state.press, _pushed(state, sample, step, now, grip, model))
    released = grip.released
    goes_on = all_of(released, motor.turns, way == state.direction)
    waits, gone, separate = _waiting(state, contact, found.sunk, released, goes_on, step, now, decided, model)
    shows = all_of(state.waits, decided, negated(released))
    mode = _mode(state, step, now, released, motor, contact)
    after = ContactState(
        mode=mode,
        turned=motor.turns,
        since=motor.since,
        left_from=state.left_from,
        held_at=state.held_at,
        went_on=any_of(goes_on, all_of(state.went_on, negated(any_of(contact, released)))),
        waits=waits,
        gone=gone,
        came=found.came,
        standing=found.standing.state,
        near_setting=found.near_setting,
        settling=found.settling,
        release=release,
        press=press,
    )
    place = ContactPlace(
        found=contact,
        evidence=any_of(all_of(separate, found.sunk), shows),
        position=ca.if_else(shows, now.position, found.position),
        std=found.std,
        at_top=ca.if_else(shows, state.direction, way) > 0.0,
    )
    hold = Hold(
        held=is_in(mode, HELD),
        released=released,
        went_on=goes_on,
        went_back=all_of(released, motor.turns, way != state.direction),
        press=press,
        stands=found.standing.stands,
        pushing=grip.pushing,
        draws=all_of(grip.back, is_in(mode, HELD)),
        give_back=grip.pressed / model.stop_stiffness,
        went=grip.went,
        shown=grip.shown,
        travel_std=grip.travel_std,
    )
    return after, Contact(place, hold, mode)


def _pushed(
    state: ContactState, sample: Sample, step: LoadStep, now: Estimated, grip: Grip, model: MachineModel
) -> Pushed:
    """The motor pushing against what holds the piston, at a sample."""
    place = likelier_at_end(now.position, now.std, state.direction, model)
    return Pushed(
        held=state.held,
        pushing=grip.pushing,
        rise=grip.rise,
        missing=grip.missing,
        elapsed=sample.elapsed,
        at_setting=at_setting(step, grip.missing, now.relief, now.relief_tolerance),
        compliance=now.compliance,
        compliance_std=now.compliance_std,
        place=ca.if_else(now.known, place, 0.0),
    )


def _motor(state: ContactState, sample: Sample, step: LoadStep, now: Estimated) -> _Motor:
    """What the motor does, and what it delivered."""
    speed, moves = sample.extending_speed, sample.elapsed > 0.0
    turns = all_of(ca.fabs(speed) > MOTOR_TURNS, moves)
    # A load that has changed at rest is found in the first moments; the piston seems to stand meanwhile.
    since = ca.if_else(count(turns) == count(state.turned), state.since + sample.elapsed, 0.0)
    free = all_of(lasted(since, LOAD_FOUND_TIME), negated(any_of(state.held, state.leaves)))
    delivered = state.standing.delivered + step.motion.free_travel  # also by leakage, where the pump holds the load
    way = ca.if_else(turns, ca.sign(speed), ca.sign(delivered))
    before = now.position - step.motion.travel  # where this sample went is as uncertain as the flow
    return _Motor(turns, since, way, all_of(moves, free), delivered, before)


def _find(
    state: ContactState, sample: Sample, step: LoadStep, now: Estimated, motor: _Motor, model: MachineModel
) -> _Found:
    """Whether the piston has come to stand on something."""
    stops, turns, way = model.assumed.stops, motor.turns, motor.way
    low, top = stops.retracted, model.stroke - stops.extended
    near = SURE_STDS * now.std + END_GIVES * model.stroke
    ahead = ca.if_else(way > 0.0, top - motor.before, motor.before - low)
    at_end = all_of(now.known, ahead < near)
    standing = _standing(state.standing, sample, step, now, motor, at_end)
    # Of a load that only resists nothing but the relief valve's pressure shows an end.
    in_vain = flag(False) if model.passive else standing.surely
    # Oil that is drawn from the tank moves nothing: the load has settled on something else.
    lowers = all_of(turns, way == -model.lift)
    if one_sided(model.balance):  # nothing presses a piston on its lowered end
        in_vain = all_of(in_vain, negated(lowers))
    sinks = all_of(step.load.empty, all_of(motor.free, lowers))
    settled, settling = _settling(state.settling, sample, step, motor.before, sinks)
    sunk = all_of(sinks, state.settling.empty)
    near_setting, over = _over(state, sample, step, now, motor, standing.stands, model)
    over = all_of(over, at_end)
    # Oil that decompresses at an end is no contact: the piston has come there, and is about to leave.
    behind = ca.if_else(way > 0.0, standing.position - low, top - standing.position)
    most = NEAR_END_SHARE * model.stroke
    came = within(state.came + step.motion.travel, -most, most)
    leaves = all_of(now.known, behind < ca.fmin(near, 0.5 * (top - low)), state.came * way < 0.0)
    contact = all_of(any_of(in_vain, sunk, over), negated(leaves))
    counts = all_of(standing.keeps, negated(contact))
    kept = replace(standing.state, delivered=ca.if_else(counts, motor.delivered, 0.0))
    # Where no oil gives it a force, nothing shows where it stands since.
    drained = any_of(sunk, is_in(state.mode, (Mode.EMPTY,)))
    # Where it is again before it was away, it was held before.
    otherwise = ca.if_else(state.leaves, state.held_at, ca.if_else(over, near_setting.position, motor.before))
    position = ca.if_else(drained, settled, ca.if_else(in_vain, standing.position, otherwise))
    # Held again soon after it seemed to go on: whether it had moved meanwhile is unknown.
    soon = ca.fabs(motor.before - state.held_at) < SEPARATE_CONTACTS * model.stroke
    unmoved = all_of(state.went_on, soon, negated(state.leaves))
    unsure = ca.if_else(unmoved, position - state.held_at, 0.0)
    std = ca.if_else(drained, SETTLING_STD_SHARE * (motor.before - settled), unsure)
    return _Found(contact, sunk, replace(standing, state=kept), position, std, near_setting, settling, came)


def _over(
    state: ContactState,
    sample: Sample,
    step: LoadStep,
    now: Estimated,
    motor: _Motor,
    seems: Flag,
    model: MachineModel,
) -> tuple[NearSettingState, Flag]:
    """Whether the pump's oil passes a relief valve, and since when the pressure is where that may open.

    At its setting a valve surely does, for no load is lifted with more. Where it may open early the pressure has come
    to rest after it rose while the piston seemed to stand, at a place that is likelier the end's than any other. What
    is as heavy while the piston moves is a load.
    """
    near = all_of(motor.turns, now.relief > 0.0, negated(state.held))
    before = state.near_setting
    rose = all_of(seems, ca.fabs(motor.delivered) > 2.0 * SURE_STDS * step.motion.noise)
    lasts = ca.if_else(all_of(near, any_of(before.lasts > 0.0, rose)), before.lasts + sample.elapsed, 0.0)
    began = ca.if_else(all_of(near, before.lasts > 0.0), before.position, motor.before)
    likely = likelier_at_end(motor.before, now.std, motor.way, model) > 0.0
    over = all_of(near, any_of(now.relief > 1.0 - OUTSIDE, all_of(lasted(lasts, VALVE_SETTLED), likely)))
    return NearSettingState(lasts=lasts, position=began), over


def _standing(
    state: StandingState, sample: Sample, step: LoadStep, now: Estimated, motor: _Motor, at_end: Flag
) -> _Standing:
    """Whether the piston stands while oil is delivered.

    By its way and not by its place, which references and the cylinder's ends move.
    """
    sigma, delivered = step.motion.noise, motor.delivered
    seems = state.moved + step.motion.travel
    softer = within(USUAL_STDS * now.compliance_std, CONTACT_SLIP, CONTACT_SLIP_UNKNOWN)
    slips = ca.if_else(now.known, ca.if_else(at_end, softer, CONTACT_SLIP), CONTACT_SLIP_UNKNOWN)

    def still(share: Real) -> Flag:
        return ca.fabs(seems) < SURE_STDS * sigma + share * ca.fabs(delivered)

    stands = all_of(motor.free, still(slips))
    # A mass that bounces on its oil stands for half a period at most.
    stood = state.since + sample.elapsed
    in_vain = all_of(all_of(stands, stood > step.motion.bounce), ca.fabs(delivered) > CONTACT_EVIDENCE * sigma)
    # A load that only grows takes some of the oil as well; it neither doubles nor comes near the relief valve's.
    changed = ca.fabs(delivered - seems) > USUAL_STDS * now.load_change_std * step.motion.give
    rare = any_of(now.relief > 0.0, changed)
    evident = any_of(still(CONTACT_SLIP), rare)
    keeps = any_of(stands, negated(sample.elapsed > 0.0))
    after = StandingState(
        since=ca.if_else(stands, stood, 0.0),
        moved=ca.if_else(keeps, seems, 0.0),
        delivered=state.delivered,
    )
    return _Standing(keeps, stands, all_of(in_vain, evident), now.position - seems, after)


def _settling(
    state: SettlingState, sample: Sample, step: LoadStep, before: Scalar, sinks: Flag
) -> tuple[Scalar, SettlingState]:
    """Where the piston was when the pump's side last carried what it had carried before [m].

    A load that settles on something else leaves the oil; while the oil decompresses the pump still delivers and the
    piston seems to go on.
    """
    carries = ca.fabs(step.load.carried)
    carried = ca.fmax(carries, state.carried * ca.exp(-sample.elapsed / MEMORY_TIME))
    position = ca.if_else(carries < (1.0 - LOAD_FALLEN_SHARE) * carried, state.position, before)
    return position, SettlingState(empty=sinks, carried=carried, position=position)


def _waiting(
    state: ContactState,
    contact: Flag,
    sunk: Flag,
    released: Flag,
    goes_on: Flag,
    step: LoadStep,
    now: Estimated,
    decided: Flag,
    model: MachineModel,
) -> tuple[Flag, Scalar, Flag]:
    """Whether a contact waits for its press, share of the stroke moved since the last one, whether it is another one.

    It is another one where the piston moved in between, where its position was unknown, and after one that turned out
    to be none.
    """
    was_none = any_of(all_of(state.waits, released), goes_on)
    gone = state.gone + ca.fabs(step.motion.travel) / model.stroke
    gone = ca.if_else(was_none, SEPARATE_CONTACTS, gone)
    separate = all_of(contact, any_of(gone >= SEPARATE_CONTACTS, negated(now.known)))
    still = all_of(state.waits, negated(any_of(released, decided, contact)))
    waits = any_of(all_of(separate, negated(sunk)), still)
    return waits, ca.if_else(contact, 0.0, ca.fmin(gone, SEPARATE_CONTACTS)), separate


def _mode(state: ContactState, step: LoadStep, now: Estimated, released: Flag, motor: _Motor, contact: Flag) -> Scalar:
    """What the piston does after the sample."""
    way = motor.way
    away = ca.fabs(now.position - state.left_from) > CONTACT_EVIDENCE * step.motion.noise
    conditions: dict[str, Condition] = {
        "stopped while it retracts": all_of(contact, way < 0.0),
        "stopped while it extends": all_of(contact, way >= 0.0),
        "released": released,
        "not yet away": negated(away),
        "no force": step.load.empty,
        "relief valve open": now.relief > 0.0,
        "motor turns": motor.turns,
        "torque shows the load": step.torque.shows > HALF,
    }
    return next_mode(state.mode, conditions)
