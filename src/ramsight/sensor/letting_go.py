"""When a piston that is held is let go.

When the motor turns the other way the stop holds the piston until its oil has decompressed to the load that it carried
before, or the oil on its other side is pressed as far; sooner, when the torque changes less than that of a closed
volume, and neither compliance nor noise explains that; at the latest when several times as much oil has been drawn
as compliance gives back. Meanwhile the torque tells the compliance.

When the motor goes on the same way the piston is let go where the torque stays behind what a closed volume would ask
for, and neither its compliance nor a relief valve that opens early explains that. Then it may not have been held since
the torque stays behind: it may have gone as far as the pump delivered, less what leaked before. Its oil was compressed
no more than the torque shows, and what it gave way by then is travel (`LoadObserver.release`).

Where the pump holds the load it also leaves a stop by itself: leakage lets the oil's force sink below the load that it
carried before, or the torque stays at that load while a closed volume would lose it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.sensor.load import LoadStep
from ramsight.sensor.virtual_sensor import SensorGraph

_NOISE = 4.0  # standard deviations
_SOFTER = 0.5  # share of what leakage changes at rest that neither it nor compliance explains, twice their deviation
_ALL = 5.0  # of what the oil gives back as described; neither compliance nor another stroke makes it so much more
SOFT = 2.0
"""Standard deviations of the compliance by which a closed volume may give more or less."""
_LEAST = 1e-6  # N m; that something is divided by
_REMEMBERED = 1.0  # s; for which the load and the leakage from before are remembered


@dataclass(frozen=True)
class Grip:
    """What holds a piston, at a sample.

    Attributes:
        rests: whether it is held while the motor stands.
        pushing: whether the motor pushes against what holds it.
        back: whether the motor turns the other way.
        released: whether it is let go.
        pressed: force of the oil beside the load that it carried before, in the direction of extension [N].
        built: change of the expected torque since the motor pushes [N m].
        rise: the same in the direction in which it pushes [N m].
        missing: what the shown torque stays behind that [N m].
        went: what the piston may have gone after all [m].
        shown: share of what its oil did while it was held that the torque shows [1]; of a piston that has just been
            let go.
        unsure: standard deviation of the way that it may have gone while the motor turns back, or stands [m].
    """

    rests: Any
    pushing: Any
    back: Any
    released: Any
    pressed: Any
    built: Any
    rise: Any
    missing: Any
    went: Any
    shown: Any
    unsure: Any


@dataclass(frozen=True)
class _Drawn:
    """What the torque says of a piston that is held while the motor turns back.

    Attributes:
        behind: it changes less than that of a closed volume.
        surely: compliance and noise do not explain it: the piston goes.
    """

    behind: Any
    surely: Any


class LettingGo:
    """Its states in a sensor's graph.

    Args:
        graph: gains states.
        lift_sign: +1 if extension lifts the load, -1 if retraction does.
        held: whether the piston is held before the sample.
        direction: the way in which it cannot go on then, +1 for extension.
    """

    def __init__(self, graph: SensorGraph, lift_sign: float, held: Any, direction: Any) -> None:
        self._graph, self._lift, self._held, self._direction = graph, lift_sign, held, direction
        self._torque = graph.state("torque_when_pushing_began")
        self._per_angle = graph.parameters.symbol("travel_per_radian")
        self._friction = graph.parameters.symbol("circuit.cylinder.coulomb_friction")
        self._loads = {name: graph.state(name) for name in ("least_load_lately", "largest_load_lately")}

    def look(self, step: LoadStep, turns: Any, keeps: Any, from_rest: Any, held_back: Any, compliance: Any) -> Grip:
        """One sample.

        Args:
            step: of the load observer.
            turns: whether the motor does.
            keeps: whether the load from before is kept: the piston stands, or is held.
            from_rest: whether it has just been found at rest on an end that it was pressed on already; of the load that
                it carried before nothing is known then.
            held_back: share of a pressure by which a relief valve may hold it lower than described [1].
            compliance: standard deviation of the compliance [1].
        """
        graph, held, direction = self._graph, self._held, self._direction
        same_way = ca.sign(graph.extending_speed) == direction
        rests = ca.logic_and(held, ca.logic_and(ca.logic_not(turns), graph.elapsed > 0.0))
        pushing = ca.logic_and(held, ca.logic_and(turns, same_way))
        back = ca.logic_and(held, ca.logic_and(turns, ca.logic_not(same_way)))
        pressed = self._lift * (step.carried - self._load_before(step.load, keeps, from_rest))
        lost = ca.logic_and(rests, pressed * direction < -self._friction)
        built = step.torque - self._torque
        graph.becomes("torque_when_pushing_began", ca.if_else(pushing, self._torque, step.torque))
        pushes_with = direction * graph.way  # sign of the torque
        missing, rise = -step.surprise * pushes_with, built * pushes_with
        explained = _NOISE * step.noise + SOFT * compliance * ca.fabs(built) + held_back * ca.fabs(step.torque)
        yields = ca.logic_and(pushing, missing > explained)
        drawn = self._drawn(step, back, compliance)
        behind = ca.logic_or(ca.logic_and(pushing, missing > compliance * rise), ca.logic_and(back, drawn.behind))
        went = self._went(step, behind, ca.logic_or(keeps, ca.logic_not(turns)))
        expected, shown = self._changes_at_rest(step, rests)
        stays = ca.logic_and(rests, _stays(step, expected, shown))
        taken = self._taken(back)
        leaves = ca.logic_and(
            back, ca.logic_or(drawn.surely, self._decompressed(step, back, taken, pressed * direction))
        )
        released = ca.logic_or(ca.logic_or(leaves, lost), ca.logic_or(yields, stays))
        went = ca.if_else(ca.logic_or(yields, leaves), went, 0.0)
        share = ca.if_else(yields, _share(rise - missing, rise), ca.if_else(stays, _share(shown, expected), 1.0))
        unsure = self._may_have_sunk(step, rests, back, expected, shown) + compliance * taken
        return Grip(rests, pushing, back, released, pressed, built, rise, missing, went, share, unsure)

    def _taken(self, back: Any) -> Any:
        """What the pump has drawn since the motor turns back, as a way of the piston [m]."""
        graph = self._graph
        pumped = ca.fabs(graph.extending_angle) * self._per_angle
        taken = ca.if_else(back, graph.state("drawn_back") + pumped, 0.0)
        graph.becomes("drawn_back", taken)
        return taken

    def _decompressed(self, step: LoadStep, back: Any, taken: Any, pressed: Any) -> Any:
        """Whether the oil presses a piston no more on what holds it, or as much has been drawn as that can take.

        Args:
            step: of the load observer.
            back: whether the motor turns back.
            taken: what has been drawn since [m].
            pressed: force of the oil towards what holds it, beside the load from before [N].
        """
        graph = self._graph
        began = graph.state("pressed_before")
        graph.becomes("pressed_before", ca.if_else(back, began, ca.fabs(pressed)))
        return ca.logic_or(pressed < -self._friction, taken > _ALL * step.give * began)

    def _drawn(self, step: LoadStep, back: Any, compliance: Any) -> _Drawn:
        """Whether a piston goes with a motor that turns back, by a torque that changes less than a closed volume's.

        The oil on the stop's side decompresses, or the one on the other side is compressed; either way the torque
        changes until the piston leaves the stop. While a valve that holds the load opens it comes a little sooner or
        later; what is looked at is the change since the torque was largest, or least.
        """
        graph, torque, noise = self._graph, step.torque, _NOISE * step.noise
        behind, surely = [], []
        for name, sign in (("torque_back_largest", 1.0), ("torque_back_least", -1.0)):
            extreme = graph.state(name)
            now = ca.if_else(back, ca.fmax(sign * extreme, sign * torque), sign * torque)
            graph.becomes(name, sign * now)
            changed, left = now - sign * torque, sign * step.surprise
            behind.append(left > compliance * changed)
            surely.append(ca.logic_and(changed > noise, left > noise + SOFT * compliance * changed))
        return _Drawn(ca.logic_or(*behind), ca.logic_or(*surely))

    def _went(self, step: LoadStep, behind: Any, keeps: Any) -> Any:
        """What the pump has delivered since the torque stays behind, less what leaked under the load from before [m].

        Args:
            step: of the load observer.
            behind: whether the torque does.
            keeps: whether the leakage from before is kept.
        """
        graph = self._graph
        pumped = graph.extending_angle * self._per_angle
        leaks, pushed = graph.state("leaked_lately"), graph.state("pushed_in_vain")
        newest = (pumped - step.free_travel) / ca.fmax(graph.elapsed, 1e-3)
        share = ca.fmin(graph.elapsed / _REMEMBERED, 1.0)
        graph.becomes("leaked_lately", ca.if_else(keeps, leaks, leaks + share * (newest - leaks)))
        went = pushed + pumped - leaks * graph.elapsed
        graph.becomes("pushed_in_vain", ca.if_else(behind, went, 0.0))
        return went

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

    def _may_have_sunk(self, step: LoadStep, rests: Any, back: Any, expected: Any, shown: Any) -> Any:
        """The way that explains how far the torque of a piston at rest stays behind, since it went along last [m].

        Args:
            step: of the load observer.
            rests: whether it is held while the motor stands.
            back: whether the motor turns back after that.
            expected: change of the expected torque since [N m].
            shown: that of the shown one [N m].
        """
        behind, least = (expected - shown) * ca.sign(expected), self._graph.state("least_behind_at_rest")
        went_along = ca.if_else(rests, ca.fmin(least, behind), 0.0)
        self._graph.becomes("least_behind_at_rest", went_along)
        sunk, way = self._graph.state("sunk_at_rest"), (behind - went_along) * step.give / self._per_angle
        may = ca.if_else(rests, way, ca.if_else(back, sunk, 0.0))
        self._graph.becomes("sunk_at_rest", may)
        return may

    def _load_before(self, load: Any, keeps: Any, unknown: Any) -> Any:
        """The load that the oil carried before the piston came to stand [N].

        While it comes to stand the load seems to collapse, for what stops it carries it: the largest or the least one
        of the last moments is the one from before.
        """
        graph = self._graph
        share = ca.if_else(graph.held("started"), ca.fmin(graph.elapsed / _REMEMBERED, 1.0), 1.0)
        kept = []
        for (name, before), extreme in zip(self._loads.items(), (ca.fmin, ca.fmax), strict=True):
            lately = ca.if_else(keeps, before, extreme(load, before + share * (load - before)))
            graph.becomes(name, ca.if_else(unknown, 0.0, lately))
            kept.append(lately)
        least, largest = kept
        return ca.if_else(self._direction * self._lift > 0.0, least, largest)


def _share(shown: Any, expected: Any) -> Any:
    """How much of a change that is expected is there, 0 to 1."""
    some = ca.fmax(shown * ca.sign(expected), 0.0)
    return ca.fmin(some / ca.fmax(ca.fabs(expected), _LEAST), 1.0)


def _stays(step: LoadStep, expected: Any, shown: Any) -> Any:
    """Whether the torque stays while a piston that is held at rest would let it change: it is not held."""
    way = ca.sign(expected)
    stays = (expected - shown) * way > _NOISE * step.noise + _SOFTER * ca.fabs(expected)
    return ca.logic_and(stays, -step.surprise * way > _NOISE * step.noise)
