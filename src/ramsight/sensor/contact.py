"""Contacts: the piston stands while the pump delivers.

A stop, the ground or an obstacle shows mostly in one way: oil is delivered, and all of it goes into compression. The
position that the load observer gives stands then, whatever the pressure is, while it would have gone on had the load
not changed:

    |sum(free travel)| > 30 sigma   while   |sum(travel)| < 4 sigma + 15 % of that sum

with sigma of the position by the torque's noise. From there on the piston is *held*: oil may pass the relief valve or
be drawn from the tank, and none of it moves the piston. Where the contact is, is not decided here (`hypotheses`).

A machine that gives way more than described seems to go on by more than that. Near an end the share is twice the
deviation of the compliance, once the load has changed by more than loads usually do, or nears the relief valve's.

Where the other chamber has no pump of its own the lowered end shows otherwise: no pressure is left anywhere, and the
pump draws from the tank.

While the motor stands, a load that is taken off looks like that for a moment: the oil's force sinks, and the piston
stands. A contact that is found at rest holds the piston at once, but says where it is only when the torque has sunk as
that of a closed volume does, nearly to nothing, or rises so once the motor pushes.

When a piston that is held is let go says `letting_go`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.sensor.assumptions import AssumedStops
from ramsight.sensor.letting_go import SOFT, LettingGo
from ramsight.sensor.load import SEEN_AT, LoadStep
from ramsight.sensor.mode import HELD, Mode, is_in, next_mode
from ramsight.sensor.virtual_sensor import SensorGraph

_SURE = 30.0  # standard deviations of the position that the pump has to deliver in vain
_STILL, _SLIPS = 4.0, 0.15  # standard deviations and share of what was delivered by which it may seem to move
_SLIPS_ANYWHERE = 0.5  # the same where the position is not known: a chamber that is full gives twice as a half full one
_RARE = 2.0  # standard deviations of the change of a load, beyond which it is rare
_OVER = 0.95  # share of the way from where a relief valve may open to its setting; no load is lifted with more
_FOUND = 0.3  # s after the motor has started or stopped, until the load is found
_PUSHING = 1.0  # rad/s; a motor that turns faster delivers
_NEAR, _NEAR_LEAST = 4.0, 5e-3  # standard deviations and share of the stroke, so near an end it is the end
_LEFT, _REMEMBERED = 0.7, 1.0  # share of what the oil carried within as many seconds: below, the load settles
_SETTLING = 0.1  # share of the seeming way since then by which that place is unsure
_APART = 0.05  # share of the stroke that the piston goes between two contacts that are not the same
_CAME = 0.02  # share of the stroke; whoever went farther back has left an end
_GONE, _GONE_NOISE = 0.1, 2.0  # share of the torque, and its standard deviations, that are left where no load is
_MODEL = 0.05  # share of a change of the torque by which a closed volume's equation may err, standard deviation
_USUALLY = 0.25  # share of a torque's rise by which machines give more than described, the softest in twenty twice that
_BUILT = 16.0  # standard deviations of the torque; of a motor that pushes a closed volume


@dataclass(frozen=True)
class Believed:
    """What is believed when a contact is looked for.

    Attributes:
        position: of the piston after the load observer's step [m].
        stroke: of the cylinder [m].
        std: of the position [m].
        known: whether the position is known.
        relief: how likely oil passes a relief valve, 0 to 1.
        held_back: share of a pressure by which such a valve may hold it lower than described [1].
        compliance: standard deviation of the compliance [1].
        unseen: standard deviation of the change of a load at rest [N].
        stiffness: of the stops [N/m].
    """

    position: Any
    stroke: Any
    std: Any
    known: Any
    relief: Any
    held_back: Any
    compliance: Any
    unseen: Any
    stiffness: Any


@dataclass(frozen=True)
class Contact:
    """Contacts at a sample.

    Attributes:
        touched: one has just been found.
        anew: it is not the last one once more, which would be no evidence.
        place: position at which the piston came to stand [m].
        place_by: derivatives of the way that it seemed to go since, with respect to factors and lag [m, m/s].
        went_on: whether it went that way all the same: it was on an end, and leaves it.
        doubt: standard deviation of that place where the oil's pressure had to tell it [m].
        at_top: whether that would be the extended end, 1 or 0: the one it was moved to, or the one that it leaves.
        held: whether the piston is held after this sample.
        leaves: whether it has just been let go, or is pulled off an end.
        released: whether it has just been let go.
        stands: whether the piston may be standing while the pump delivers, not yet surely.
        pushing: whether the motor pushes against what holds it.
        draws: whether it draws oil from what is still held.
        built: change of the expected torque since it pushes [N m].
        given_way: by which what holds it gives way under it, extension positive [m].
        went: what a piston that is let go may have gone after all, while it was thought to be held [m].
        shown: share of what its oil did meanwhile that the torque shows [1].
        unsure: standard deviation of the way that a piston which is held may have gone, drawn off or by leakage [m].
        mode: what the piston is doing after this sample, a number of `Mode`.
    """

    touched: Any
    anew: Any
    place: Any
    place_by: list[Any]
    went_on: Any
    doubt: Any
    at_top: Any
    held: Any
    leaves: Any
    released: Any
    stands: Any
    pushing: Any
    draws: Any
    built: Any
    given_way: Any
    went: Any
    shown: Any
    unsure: Any
    mode: Any


@dataclass(frozen=True)
class _Standing:
    """Whether a piston stands while oil is delivered.

    Attributes:
        keeps: whether what was delivered still counts.
        stands: whether it may stand.
        surely: whether it does.
        anchor: where it came to stand [m].
        by: derivatives of what it seemed to go since [m, m/s].
    """

    keeps: Any
    stands: Any
    surely: Any
    anchor: Any
    by: list[Any]


@dataclass(frozen=True)
class _Found:
    """What the sample says of a contact.

    Attributes:
        turns: whether the motor turns.
        way: +1 for extension, in which the piston was delivered oil.
        before: position before the sample [m].
        standing: whether the piston stands.
        in_vain: whether it surely does while oil is delivered.
        sunk: whether its load has come to stand on something else.
        touched: whether a contact is found.
        leaving: whether it is the end that the piston is about to leave.
        settled: where a load that stands on something else came to stand [m].
    """

    turns: Any
    way: Any
    before: Any
    standing: _Standing
    in_vain: Any
    sunk: Any
    touched: Any
    leaving: Any
    settled: Any


class ContactWatch:
    """Its states in a sensor's graph.

    Args:
        graph: gains states.
        lift_sign: +1 if extension lifts the load, -1 if retraction does.
        stops: where the machine's stops are.
        resists: whether the load only resists, so that a piston may stand anywhere until the oil overcomes it.
    """

    def __init__(self, graph: SensorGraph, lift_sign: float, stops: AssumedStops, *, resists: bool = False) -> None:
        self._graph, self._lift, self._stops, self._resists = graph, lift_sign, stops, resists
        self._stood = graph.state("stands_for")
        self._sank = graph.state("sank")
        self._mode = graph.state("mode")
        self.held = is_in(self._mode, HELD)
        self.leaves = is_in(self._mode, (Mode.LEAVING,))
        self._direction = ca.if_else(self._mode == float(Mode.HELD_EXTENDING), 1.0, -1.0)
        self._seemed = graph.state("seemed_to_move")
        self._delivered = graph.state("delivered_in_vain")
        self._turned, self._since = graph.state("turned"), graph.state("turns_or_rests_for")
        self._left_from, self._gone = graph.state("left_from"), graph.state("gone_since_contact", _APART)
        self._held_at = graph.state("held_at")
        self._waits, self._found_with = graph.state("contact_waits"), graph.state("found_with")
        self._leaves_way = graph.state("leaves_way")
        self._carried, self._carried_at = graph.state("carried_lately"), graph.state("carried_until")
        self._carries_at = self._carried_at
        self._grip = LettingGo(graph, lift_sign, self.held, self._direction)

    def before_it(self, position: Any) -> Any:
        """A position that is not beyond what the motor pulls it off: it does not go through that [m]."""
        way, left_from = self._leaves_way, self._left_from
        kept = ca.if_else(way > 0.0, ca.fmax(position, left_from), ca.fmin(position, left_from))
        return ca.if_else(ca.logic_and(self.leaves, way != 0.0), kept, position)

    def look(self, step: LoadStep, believed: Believed, travel_by: Sequence[Any] = ()) -> Contact:
        """One sample.

        Args:
            step: of the load observer.
            believed: of the piston after it.
            travel_by: derivatives of the step's travel with respect to factors and lag [m, m/s].
        """
        graph, position, relief = self._graph, believed.position, believed.relief
        found = self._find(step, believed, travel_by)
        turns, way, touched, leaving = found.turns, found.way, found.touched, found.leaving
        keeps = found.standing.keeps
        holds, off = ca.logic_and(touched, ca.logic_not(leaving)), ca.logic_and(touched, leaving)
        # At rest only leakage takes its oil away, and no end lets go by that: what the end carries goes with it.
        pulled, stays = ca.logic_and(off, turns), ca.logic_and(off, ca.logic_not(turns))
        keeps_load = ca.logic_or(keeps, ca.logic_or(self.held, touched))
        soft = ca.fmax(believed.compliance, _MODEL)
        grip = self._grip.look(step, turns, keeps_load, stays, believed.held_back, soft)
        away = ca.fabs(position - self._left_from) > _SURE * step.noise_travel
        conditions = {
            "stopped while it retracts": ca.logic_or(ca.logic_and(holds, way < 0.0), ca.logic_and(stays, way > 0.0)),
            "stopped while it extends": ca.logic_or(ca.logic_and(holds, way >= 0.0), ca.logic_and(stays, way <= 0.0)),
            "pulled off an end": pulled,
            "let go": grip.released,
            "not yet away": ca.logic_not(away),
            "no force": step.empty,
            "relief valve open": relief > 0.0,
            "motor turns": turns,
            "torque shows the load": step.seen > SEEN_AT,
        }
        mode = next_mode(self._mode, conditions)
        graph.becomes("mode", mode)
        leaves = ca.logic_or(grip.released, pulled)
        graph.becomes("leaves_way", ca.if_else(grip.back, way, ca.if_else(leaves, 0.0, self._leaves_way)))
        follows = _gone(step, graph.motor_torque, grip.rests, self._found_with)
        follows = ca.logic_or(follows, ca.logic_and(grip.pushing, _builds(step, grip.rise, grip.missing)))
        was_none = ca.logic_and(self._waits, grip.released)
        anew = self._is_anew(touched, step, believed.stroke, believed.known, was_none)
        later = ca.logic_and(anew, ca.logic_not(turns))
        shows = self._waited(step, touched, later, follows, grip.released)
        at_top = ca.if_else(leaving, way < 0.0, ca.if_else(shows, self._direction > 0.0, way > 0.0))
        stood_at, doubt, place_by, by_way = self._stood_at(found)
        return Contact(
            touched=touched,
            anew=ca.logic_or(ca.logic_and(anew, ca.logic_not(later)), shows),
            place=ca.if_else(shows, position, stood_at),
            place_by=place_by,
            went_on=ca.logic_and(pulled, by_way),
            doubt=doubt,
            at_top=at_top,
            held=is_in(mode, HELD),
            leaves=leaves,
            released=grip.released,
            stands=found.standing.stands,
            pushing=grip.pushing,
            draws=ca.logic_and(grip.back, is_in(mode, HELD)),
            built=grip.built,
            given_way=grip.pressed / believed.stiffness,
            went=grip.went,
            shown=grip.shown,
            unsure=grip.unsure,
            mode=mode,
        )

    def _find(self, step: LoadStep, believed: Believed, travel_by: Sequence[Any]) -> _Found:
        """Whether the piston has come to stand on something, and whether that is an end that it leaves."""
        graph, w = self._graph, self._graph.extending_speed
        position, stroke, known, relief = believed.position, believed.stroke, believed.known, believed.relief
        moves = graph.elapsed > 0.0
        turns = ca.logic_and(ca.fabs(w) > _PUSHING, moves)
        # A load that has changed at rest is found in the first moments; the piston seems to stand meanwhile.
        since = ca.if_else(turns == self._turned, self._since + graph.elapsed, 0.0)
        graph.becomes("turned", turns)
        graph.becomes("turns_or_rests_for", since)
        free = ca.logic_and(since > _FOUND, ca.logic_not(ca.logic_or(self.held, self.leaves)))
        delivered = self._delivered + step.free_travel  # also by leakage, where the pump holds the load at rest
        way = ca.if_else(turns, ca.sign(w), ca.sign(delivered))
        before = position - step.travel  # where this sample went is as doubtful as the flow
        low, top = self._stops.retracted, stroke - self._stops.extended
        near = _NEAR * believed.std + _NEAR_LEAST * stroke
        ahead = ca.if_else(way > 0.0, top - before, before - low)
        ends = ca.logic_and(known, ahead < near)
        standing = self._standing(step, believed, travel_by, delivered, ends, ca.logic_and(moves, free))
        # Of a load that only resists none but the relief valve's pressure tells an end.
        in_vain = 0.0 if self._resists else standing.surely
        # Oil that is drawn from the tank moves nothing: the load has come to stand on something else.
        lowers = ca.logic_and(turns, way == -self._lift)
        sinks = ca.logic_and(step.empty, ca.logic_and(free, lowers))
        # At an end a relief valve soon takes all that the pump delivers; nowhere else is that sure.
        settled = self._settles(step, before)
        over = ca.logic_and(ca.logic_and(turns, relief > _OVER), ca.logic_and(ends, ca.logic_not(self.held)))
        sunk = ca.logic_and(sinks, self._sank)
        touched = ca.logic_or(in_vain, ca.logic_or(sunk, over))
        graph.becomes("sank", sinks)
        # Oil that decompresses at an end: a piston that has come there is about to leave.
        anchor, keeps = standing.anchor, standing.keeps
        behind = ca.if_else(way > 0.0, anchor - low, top - anchor)
        nearer = behind < top - low - behind
        leaving = ca.logic_and(ca.logic_and(known, nearer), behind < near)
        leaving = ca.logic_and(leaving, self._came(step.travel, stroke) * way < 0.0)
        graph.becomes("delivered_in_vain", ca.if_else(ca.logic_and(keeps, ca.logic_not(touched)), delivered, 0.0))
        return _Found(turns, way, before, standing, in_vain, sunk, touched, leaving, settled)

    def _stood_at(self, found: _Found) -> tuple[Any, Any, list[Any], Any]:
        """Where a piston stood [m], how doubtful that is [m], derivatives of its way since, and whether it has one."""
        # Where it is again before it was away it was held before; the stop that gave way meanwhile does so once more.
        again = ca.if_else(self.leaves, self._held_at, found.before)
        # Where no oil gives it a force, nothing shows where it stands since.
        drained = ca.logic_or(found.sunk, is_in(self._mode, (Mode.EMPTY,)))
        stood_at = ca.if_else(drained, found.settled, ca.if_else(found.in_vain, found.standing.anchor, again))
        doubt = ca.if_else(drained, _SETTLING * (found.before - found.settled), 0.0)
        by_way = ca.logic_and(found.in_vain, ca.logic_not(drained))
        return stood_at, doubt, [ca.if_else(by_way, by, 0.0) for by in found.standing.by], by_way

    def _standing(
        self,
        step: LoadStep,
        believed: Believed,
        travel_by: Sequence[Any],
        delivered: Any,
        ends: Any,
        free: Any,
    ) -> _Standing:
        """Whether the piston stands while oil is delivered.

        By its way and not by its place, which references and the cylinder's ends move.

        Args:
            step: of the load observer.
            believed: of the piston after it.
            travel_by: derivatives of the step's travel [m, m/s].
            delivered: way that it would have gone under the same load [m].
            ends: whether an end is so near that it may be there.
            free: whether time passes and nothing holds it yet.
        """
        graph, sigma = self._graph, step.noise_travel
        seems = self._seemed + step.travel
        softer = ca.fmin(ca.fmax(SOFT * believed.compliance, _SLIPS), _SLIPS_ANYWHERE)
        slips = ca.if_else(believed.known, ca.if_else(ends, softer, _SLIPS), _SLIPS_ANYWHERE)

        def still(share: Any) -> Any:
            return ca.fabs(seems) < _STILL * sigma + share * ca.fabs(delivered)

        stands = ca.logic_and(free, still(slips))
        # A mass that bounces on its oil stands for half a period at most.
        stood = self._stood + graph.elapsed
        graph.becomes("stands_for", ca.if_else(stands, stood, 0.0))
        in_vain = ca.logic_and(ca.logic_and(stands, stood > step.bounce), ca.fabs(delivered) > _SURE * sigma)
        # A load that only grows takes some of the oil as well; it neither doubles nor comes near the relief valve's.
        rare = ca.logic_or(believed.relief > 0.0, ca.fabs(delivered - seems) > _RARE * believed.unseen * step.give)
        told = ca.logic_or(still(_SLIPS), ca.logic_or(rare, ca.logic_not(believed.known)))
        keeps = ca.logic_or(stands, ca.logic_not(graph.elapsed > 0.0))
        graph.becomes("seemed_to_move", ca.if_else(keeps, seems, 0.0))
        by = [graph.state(f"seemed_to_move_by_{k}") + new for k, new in enumerate(travel_by)]
        for k, value in enumerate(by):
            graph.becomes(f"seemed_to_move_by_{k}", ca.if_else(keeps, value, 0.0))
        return _Standing(keeps, stands, ca.logic_and(in_vain, told), believed.position - seems, by)

    def close(self, contact: Contact, position: Any, moved: Any) -> None:
        """Places that are kept go with the position.

        Args:
            contact: of this sample.
            position: after all measurements [m].
            moved: by how much they moved it [m].
        """
        graph, leaves = self._graph, contact.leaves
        came_back = ca.if_else(contact.released, contact.given_way, 0.0)
        graph.becomes("left_from", ca.if_else(leaves, position, self._left_from + moved))
        graph.becomes("held_at", ca.if_else(leaves, position - came_back, self._held_at + moved))
        graph.becomes("carried_until", self._carries_at + moved)

    def _came(self, travel: Any, stroke: Any) -> Any:
        """The way that the piston went last, of which the newest hundredths of the stroke decide [m]."""
        came, most = self._graph.state("came"), _CAME * stroke
        self._graph.becomes("came", ca.fmin(ca.fmax(came + travel, -most), most))
        return came

    def _is_anew(self, touched: Any, step: LoadStep, stroke: Any, known: Any, was_none: Any) -> Any:
        """Whether a contact is another one than the last: the piston went somewhere, or nobody knew where it was.

        After one that turns out to be none any is.
        """
        gone = ca.if_else(was_none, _APART, self._gone + ca.fabs(step.travel) / stroke)
        self._graph.becomes("gone_since_contact", ca.if_else(touched, 0.0, ca.fmin(gone, _APART)))
        return ca.logic_and(touched, ca.logic_or(gone >= _APART, ca.logic_not(known)))

    def _waited(self, step: LoadStep, touched: Any, later: Any, follows: Any, released: Any) -> Any:
        """Whether a contact that was found at rest says now where the piston is; what was let go before never does.

        Args:
            step: of the load observer.
            touched: whether a contact has just been found.
            later: whether it has to wait.
            follows: whether the torque of a piston that is held has gone as that of a closed volume does.
            released: whether it has just been let go.
        """
        shows = ca.logic_and(self._waits, ca.logic_and(follows, ca.logic_not(released)))
        waits = ca.logic_and(self._waits, ca.logic_not(ca.logic_or(released, shows)))
        self._graph.becomes("contact_waits", ca.if_else(touched, later, waits))
        self._graph.becomes("found_with", ca.if_else(touched, step.torque, self._found_with))
        return shows

    def _settles(self, step: LoadStep, before: Any) -> Any:
        """Where the piston was when the pump's side last carried what it had carried before [m].

        A load that settles on something else leaves the oil; while the oil decompresses the pump still delivers and
        the piston seems to go on.
        """
        lately = self._carried * ca.exp(-self._graph.elapsed / _REMEMBERED)
        carried = ca.fmax(ca.fabs(step.carried), lately)
        place = ca.if_else(ca.fabs(step.carried) < _LEFT * carried, self._carried_at, before)
        self._graph.becomes("carried_lately", carried)
        self._carries_at = place
        return place


def _gone(step: LoadStep, torque: Any, rests: Any, found_with: Any) -> Any:
    """Whether the torque of a piston that is held at rest has gone, the expected one and the shown one."""
    left = ca.fmax(ca.fabs(step.torque), ca.fabs(torque))
    return ca.logic_and(rests, left < ca.fmax(_GONE * ca.fabs(found_with), _GONE_NOISE * step.noise))


def _builds(step: LoadStep, built: Any, missing: Any) -> Any:
    """Whether the torque of a motor that pushes rises as a closed volume lets it."""
    return ca.logic_and(built > _BUILT * step.noise, missing < _USUALLY * built)
