"""Contacts: the piston stands while the pump delivers.

A stop, the ground or an obstacle shows mostly in one way: oil is delivered, and all of it goes into compression. The
position that the load observer gives stands then, whatever the pressure is, while it would have gone on had the load
not changed:

    |sum(free travel)| > 30 sigma   while   |sum(travel)| < 4 sigma + 15 % of that sum

with sigma of the position by the torque's noise. From there on the piston is *held*: oil may pass the relief valve or
be drawn from the tank, and none of it moves the piston. Where the contact is, is not decided here (`hypotheses`).

Where the other chamber has no pump of its own the lowered end shows otherwise: no pressure is left anywhere, and the
pump draws from the tank.

While the motor stands, a load that is taken off looks like that for a moment: the oil's force sinks, and the piston
stands. A contact that is found at rest holds the piston at once, but says where it is only when the torque has sunk as
that of a closed volume does, nearly to nothing, or rises so once the motor pushes.

It is let go when the motor turns the other way (oil that decompresses is in the observer, so a piston that still stands
is seen to stand), or when the torque stays behind what a closed volume would ask for. Where the pump holds the load it
also leaves a stop by itself: leakage lets the oil's force sink below the load that it carried before, or the torque
stays at that load while a closed volume would lose it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.sensor.assumptions import AssumedStops
from ramsight.sensor.load import SEEN_AT, LoadStep
from ramsight.sensor.mode import HELD, Mode, is_in, next_mode
from ramsight.sensor.virtual_sensor import SensorGraph

_SURE = 30.0  # standard deviations of the position that the pump has to deliver in vain
_STILL, _SLIPS = 4.0, 0.15  # standard deviations and share of what was delivered by which it may seem to move
_SLIPS_ANYWHERE = 0.5  # the same where the position is not known: a chamber that is full gives twice as a half full one
_OVER = 0.95  # share of the way from where a relief valve may open to its setting; no load is lifted with more
_FOUND = 0.3  # s after the motor has started or stopped, until the load is found
_PUSHING = 1.0  # rad/s; a motor that turns faster delivers
_NEAR, _NEAR_LEAST = 4.0, 5e-3  # standard deviations and share of the stroke, so near an end it is the end
_LEFT, _REMEMBERED = 0.7, 1.0  # share of what the oil carried within as many seconds: below, the load settles
_SETTLING = 0.1  # share of the seeming way since then by which that place is unsure
_NOISE = 4.0  # standard deviations
_APART = 0.05  # share of the stroke that the piston goes between two contacts that are not the same
_CAME = 0.02  # share of the stroke; whoever went farther back has left an end
_SOFTER = 0.5  # share of the expected torque's change that compliance does not explain, twice its deviation
_USUALLY = 0.25  # the same, its deviation
_GONE, _GONE_NOISE = 0.1, 2.0  # share of the torque, and its standard deviations, that are left where no load is
_BUILT = 16.0  # standard deviations of the torque; of a motor that pushes a closed volume


@dataclass(frozen=True)
class Contact:
    """Contacts at a sample.

    Attributes:
        touched: one has just been found.
        anew: it is not the last one once more, which would be no evidence.
        place: position at which the piston came to stand [m].
        doubt: standard deviation of that place where the oil's pressure had to tell it [m].
        at_top: whether that would be the extended end, 1 or 0: the one it was moved to, or the one that it leaves.
        held: whether the piston is held after this sample.
        released: whether it has just been let go.
        stands: whether the piston may be standing while the pump delivers, not yet surely.
        pushing: whether the motor pushes against what holds it.
        built: change of the expected torque since it pushes [N m].
        given_way: by which what holds it gives way under it, extension positive [m].
        mode: what the piston is doing after this sample, a number of `Mode`.
    """

    touched: Any
    anew: Any
    place: Any
    doubt: Any
    at_top: Any
    held: Any
    released: Any
    stands: Any
    pushing: Any
    built: Any
    given_way: Any
    mode: Any


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
        self._torque = graph.state("torque_when_pushing_began")
        self._friction = graph.parameters.symbol("circuit.cylinder.coulomb_friction")
        self._loads = {name: graph.state(name) for name in ("least_load_lately", "largest_load_lately")}
        self._carried, self._carried_at = graph.state("carried_lately"), graph.state("carried_until")

    def before_it(self, position: Any) -> Any:
        """A position that is not beyond what the motor pulls it off: it does not go through that [m]."""
        way, left_from = self._leaves_way, self._left_from
        kept = ca.if_else(way > 0.0, ca.fmax(position, left_from), ca.fmin(position, left_from))
        return ca.if_else(ca.logic_and(self.leaves, way != 0.0), kept, position)

    def look(
        self, step: LoadStep, position: Any, stroke: Any, std: Any, known: Any, relief: Any, stiffness: Any
    ) -> Contact:
        """One sample.

        Args:
            step: of the load observer.
            position: of the piston after it [m].
            stroke: of the cylinder [m].
            std: of the position [m].
            known: whether the position is known.
            relief: how likely oil passes a relief valve, 0 to 1.
            stiffness: of the stops [N/m].
        """
        graph, w = self._graph, self._graph.extending_speed
        sigma, moves = step.noise_travel, graph.elapsed > 0.0
        turns = ca.logic_and(ca.fabs(w) > _PUSHING, moves)
        # A load that has changed at rest is found in the first moments; the piston seems to stand meanwhile.
        since = ca.if_else(turns == self._turned, self._since + graph.elapsed, 0.0)
        graph.becomes("turned", turns)
        graph.becomes("turns_or_rests_for", since)
        free = ca.logic_and(since > _FOUND, ca.logic_not(ca.logic_or(self.held, self.leaves)))
        delivered = self._delivered + step.free_travel  # also by leakage, where the pump holds the load at rest
        way = ca.if_else(turns, ca.sign(w), ca.sign(delivered))
        slips = ca.if_else(known, _SLIPS, _SLIPS_ANYWHERE)
        # By its way and not by its place, which references and the cylinder's ends move.
        seems = self._seemed + step.travel
        anchor = position - seems
        still = ca.fabs(seems) < _STILL * sigma + slips * ca.fabs(delivered)
        stands = ca.logic_and(ca.logic_and(moves, free), still)
        # A mass that bounces on its oil stands for half a period at most.
        stood = self._stood + graph.elapsed
        graph.becomes("stands_for", ca.if_else(stands, stood, 0.0))
        in_vain = ca.logic_and(ca.logic_and(stands, stood > step.bounce), ca.fabs(delivered) > _SURE * sigma)
        in_vain = 0.0 if self._resists else in_vain  # then only the relief valve's pressure tells an end from the load
        # Oil that is drawn from the tank moves nothing: the load has come to stand on something else.
        lowers = ca.logic_and(turns, way == -self._lift)
        sinks = ca.logic_and(step.empty, ca.logic_and(free, lowers))
        # At an end a relief valve soon takes all that the pump delivers; nowhere else is that sure.
        before = position - step.travel  # where this sample went is as doubtful as the flow
        settled = self._settles(step, before)
        low, top = self._stops.retracted, stroke - self._stops.extended
        ahead = ca.if_else(way > 0.0, top - before, before - low)
        ends = ca.logic_and(known, ahead < _NEAR * std + _NEAR_LEAST * stroke)
        over = ca.logic_and(ca.logic_and(turns, relief > _OVER), ca.logic_and(ends, ca.logic_not(self.held)))
        sunk = ca.logic_and(sinks, self._sank)
        touched = ca.logic_or(in_vain, ca.logic_or(sunk, over))
        graph.becomes("sank", sinks)
        # Oil that decompresses at an end: a piston that has come there is about to leave.
        behind = ca.if_else(way > 0.0, anchor - low, top - anchor)
        nearer = behind < top - low - behind
        leaving = ca.logic_and(ca.logic_and(known, nearer), behind < _NEAR * std + _NEAR_LEAST * stroke)
        leaving = ca.logic_and(leaving, self._came(step.travel, stroke) * way < 0.0)
        keeps = ca.logic_or(stands, ca.logic_not(graph.elapsed > 0.0))
        graph.becomes("delivered_in_vain", ca.if_else(ca.logic_and(keeps, ca.logic_not(touched)), delivered, 0.0))
        graph.becomes("seemed_to_move", ca.if_else(keeps, seems, 0.0))
        keeps_load = ca.logic_or(keeps, ca.logic_or(self.held, touched))
        pressed = self._lift * (step.carried - self._load_before(step.load, keeps_load))

        rests = ca.logic_and(self.held, ca.logic_and(ca.logic_not(turns), moves))
        pushing = ca.logic_and(self.held, ca.logic_and(turns, way == self._direction))
        expected, shown = self._changes_at_rest(step, rests)
        back = ca.logic_and(self.held, ca.logic_and(turns, way != self._direction))
        built = step.torque - self._torque
        pushes_with = self._direction * graph.way  # sign of the torque
        missing = -step.surprise * pushes_with
        yields = ca.logic_and(pushing, missing > _NOISE * step.noise + _SOFTER * ca.fabs(built))
        yields = ca.logic_or(yields, ca.logic_and(rests, _stays(step, expected, shown)))
        lost = ca.logic_and(rests, pressed * self._direction < -self._friction)
        released = ca.logic_or(ca.logic_or(back, yields), lost)
        holds = ca.logic_and(touched, ca.logic_not(leaving))
        graph.becomes("torque_when_pushing_began", ca.if_else(pushing, self._torque, step.torque))
        away = ca.fabs(position - self._left_from) > _SURE * sigma
        pulled = ca.logic_and(touched, leaving)
        conditions = {
            "stopped while it retracts": ca.logic_and(holds, way < 0.0),
            "stopped while it extends": ca.logic_and(holds, way >= 0.0),
            "pulled off an end": pulled,
            "let go": released,
            "not yet away": ca.logic_not(away),
            "no force": step.empty,
            "relief valve open": relief > 0.0,
            "motor turns": turns,
            "torque shows the load": step.seen > SEEN_AT,
        }
        mode = next_mode(self._mode, conditions)
        graph.becomes("mode", mode)
        held = is_in(mode, HELD)
        leaves = ca.logic_or(released, pulled)
        given_way = pressed / stiffness
        graph.becomes("left_from", ca.if_else(leaves, position + given_way, self._left_from))
        graph.becomes("leaves_way", ca.if_else(back, way, ca.if_else(leaves, 0.0, self._leaves_way)))
        graph.becomes("held_at", ca.if_else(leaves, position, self._held_at))
        # Where it is again before it was away it was held before; the stop that gave way meanwhile does so once more.
        again = ca.if_else(self.leaves, self._held_at, before)
        # Where no oil gives it a force, nothing shows where it stands since.
        drained = ca.logic_or(sunk, is_in(self._mode, (Mode.EMPTY,)))
        stood_at = ca.if_else(drained, settled, ca.if_else(in_vain, anchor, again))
        doubt = ca.if_else(drained, _SETTLING * (before - settled), 0.0)
        follows = _gone(step, graph.motor_torque, rests, self._found_with)
        follows = ca.logic_or(follows, ca.logic_and(pushing, _builds(step, built * pushes_with, missing)))
        anew = self._is_anew(touched, step, stroke, known, ca.logic_and(self._waits, released))
        later = ca.logic_and(anew, ca.logic_and(holds, ca.logic_not(turns)))
        shows = self._waited(step, touched, later, follows, released)
        at_top = ca.if_else(leaving, way < 0.0, ca.if_else(shows, self._direction > 0.0, way > 0.0))
        return Contact(
            touched,
            ca.logic_or(ca.logic_and(anew, ca.logic_not(later)), shows),
            ca.if_else(shows, position, stood_at),
            doubt,
            at_top,
            held,
            released,
            stands,
            pushing,
            built,
            given_way,
            mode,
        )

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

    def _changes_at_rest(self, step: LoadStep, rests: Any) -> tuple[Any, Any]:
        """Changes of the expected torque and of the shown one since a piston is held at rest [N m].

        It is the change that counts: a load that was taken slowly may have been another one when the piston seemed to
        stand.
        """
        graph = self._graph
        rested = graph.state("held_at_rest")
        names = ("torque_when_rest_began", "torque_shown_when_rest_began")
        changes = []
        for name, now in zip(names, (step.torque, graph.motor_torque), strict=True):
            began = graph.state(name)
            graph.becomes(name, ca.if_else(ca.logic_and(rests, rested), began, now))
            changes.append(ca.if_else(rested, now - began, 0.0))
        graph.becomes("held_at_rest", rests)
        expected, shown = changes
        return expected, shown

    def _load_before(self, load: Any, keeps: Any) -> Any:
        """The load that the oil carried before the piston came to stand [N].

        While it comes to stand the load seems to collapse, for what stops it carries it: the largest or the least one
        of the last moments is the one from before.
        """
        graph = self._graph
        share = ca.if_else(graph.held("started"), ca.fmin(graph.elapsed / _REMEMBERED, 1.0), 1.0)
        kept = []
        for (name, before), extreme in zip(self._loads.items(), (ca.fmin, ca.fmax), strict=True):
            lately = ca.if_else(keeps, before, extreme(load, before + share * (load - before)))
            graph.becomes(name, lately)
            kept.append(lately)
        least, largest = kept
        return ca.if_else(self._direction * self._lift > 0.0, least, largest)

    def _settles(self, step: LoadStep, before: Any) -> Any:
        """Where the piston was when the pump's side last carried what it had carried before [m].

        A load that settles on something else leaves the oil; while the oil decompresses the pump still delivers and
        the piston seems to go on.
        """
        lately = self._carried * ca.exp(-self._graph.elapsed / _REMEMBERED)
        carried = ca.fmax(ca.fabs(step.carried), lately)
        place = ca.if_else(ca.fabs(step.carried) < _LEFT * carried, self._carried_at, before)
        self._graph.becomes("carried_lately", carried)
        self._graph.becomes("carried_until", place)
        return place


def _stays(step: LoadStep, expected: Any, shown: Any) -> Any:
    """Whether the torque stays while a piston that is held at rest would let it change: it is not held."""
    way = ca.sign(expected)
    stays = (expected - shown) * way > _NOISE * step.noise + _SOFTER * ca.fabs(expected)
    return ca.logic_and(stays, -step.surprise * way > _NOISE * step.noise)


def _gone(step: LoadStep, torque: Any, rests: Any, found_with: Any) -> Any:
    """Whether the torque of a piston that is held at rest has gone, the expected one and the shown one."""
    left = ca.fmax(ca.fabs(step.torque), ca.fabs(torque))
    return ca.logic_and(rests, left < ca.fmax(_GONE * ca.fabs(found_with), _GONE_NOISE * step.noise))


def _builds(step: LoadStep, built: Any, missing: Any) -> Any:
    """Whether the torque of a motor that pushes rises as a closed volume lets it."""
    return ca.logic_and(built > _BUILT * step.noise, missing < _USUALLY * built)
