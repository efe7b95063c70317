"""A cylinder's position control as one step of a recursion, of which C is made: state and inputs in, motor speed out.

The laws are those of `ramsight.control.actuation` and `ramsight.control.trajectory`, and what follows an activity
stands in the table of `ramsight.control.activity`; a graph is in the place of Python's objects, and a test holds both
to the same commands. Not in it are leak tests: they stay with whoever drives the machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.control.activity import Activity, Event
from ramsight.control.activity_graph import LAST, ActivityGraph, either
from ramsight.control.actuation import Actuation
from ramsight.control.moving import PUSHING, leaving
from ramsight.control.orders import ACTIVITIES, INPUTS, NOTHING, OUTPUTS, STOPPED_BY, Ask, Reason
from ramsight.control.trajectory import Limits, ahead, begun, places, smoothed
from ramsight.control.tuning import Tuning
from ramsight.control.visit_graph import STATES, Visit
from ramsight.control.watch import Verdict
from ramsight.control.watch_graph import WatchGraph
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.engine.recursion import Recursion
from ramsight.plant.either import both, choose, known, least, most, towards
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit


@dataclass(frozen=True, eq=False)
class Block:
    """A control as a recursion.

    Attributes:
        recursion: its graph; the inputs are `INPUTS`, the outputs `OUTPUTS`.
        initial: state at power-up: at rest, with no target.
        period: of its samples [s].
        limits: of the cylinder.
        response: how its drive is declared to follow.
    """

    recursion: Recursion
    initial: NDArray[np.float64]
    period: float
    limits: Limits
    response: DriveResponse


def position_block(
    unit: HydraulicUnit,
    limits: Limits | None = None,
    tuning: Tuning | None = None,
    period: float = SAMPLE_PERIOD,
    response: DriveResponse = IDEAL,
) -> Block:
    """The position control of a unit, with its watch over the drive, as a graph.

    Args:
        unit: the unit's parts, as its data sheet has them.
        limits: what the cylinder may do; by default `Limits.of(unit)`.
        tuning: how it is driven.
        period: of the samples [s].
        response: how the drive is declared to follow its commands.

    Raises:
        DescriptionError: the motor cannot turn as fast as a valve of the unit asks for before it opens.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build_unit
        >>> block = position_block(build_unit("boom", machine.load("mining-loader").unit("boom")))
        >>> len(block.recursion.state) < 100, block.recursion.outputs
        (True, ('motor_speed', 'activity', 'reason', 'reference'))
    """
    used = limits or Limits.of(unit)
    by = Actuation(unit, used, tuning or Tuning(), period, response)
    graph = _Step(by, WatchGraph(unit, response, period))
    x, u = ca.vertcat(*graph.x.values()), ca.vertcat(*graph.u.values())
    new, out = graph.result()
    recursion = Recursion(
        tuple(graph.x), tuple(INPUTS), (), tuple(OUTPUTS), x, u, ca.SX.sym("p", 0), ca.vertcat(*new), ca.vertcat(*out)
    )
    start = dict.fromkeys(graph.x, 0.0) | LAST | graph.watch.initial
    start |= {
        "activity": float(ACTIVITIES.index(Activity.RESTING)),
        "place": NOTHING,
        "target": NOTHING,
        "ask": float(Ask.POSITION),
        "temperature": T40,
        "direction": 1.0,
        "end": NOTHING,
    }
    return Block(recursion, np.array([start[name] for name in graph.x]), period, used, response)


class _Step(ActivityGraph):
    """One step: the orders, the sensor's judgement, what the activity asks for, what follows it."""

    def __init__(self, by: Actuation, watch: WatchGraph) -> None:
        self.count = places(by.limits, by.period)
        been = [f"been_{k}" for k in range(self.count + 1)]
        names = (
            "motor_speed", "activity", "fresh", "target", "ask", "place", "direction", "tries", "stood", "pushed",
            "slope", "reason", "temperature", "lead_velocity", "left",
        )  # fmt: skip
        super().__init__(by, (*names, *STATES, *LAST, *watch.initial, *been))
        self.watch = watch
        self.been = [self.x[name] for name in been]
        self.visit = Visit(self)

    def result(self) -> tuple[list[Any], list[Any]]:
        """The next state and the outputs."""
        self._look()
        self._order()
        self._judge()
        self._enter()
        wish = self._do()
        s = self.s
        speed = self.by.ramped(s["motor_speed"], wish, s["used_slope"])
        s["motor_speed"] = speed
        s |= {f"been_{k}": place for k, place in enumerate(self.been)}
        told = self.visit.told(speed)
        return [s[name] for name in self.x], [speed, s["activity"], s["reason"], told]

    def _asked(self) -> tuple[Any, Any, Any]:
        """Whether the target is one, whether the rod is sent to it anew, and whether a hand takes it."""
        ask, target = self.u["ask"], self.u["target"]
        inside = both(target >= 0.0, target <= self.by.unit.cylinder.stroke)
        other = ca.logic_or(target != self.x["target"], ask != self.x["ask"])
        sent = both(both(ask == float(Ask.POSITION), inside), other)
        return inside, sent, both(ask == float(Ask.STEER), ask != self.x["ask"])

    def _look(self) -> None:
        """What the drive does, and which way is on its way."""
        _, sent, taken = self._asked()
        self.watch.begin(self.s, either(sent, taken, self.visit.asked()))
        reported = self.u["reported_speed"], self.u["reported_torque"]
        self.verdicts = self.watch.look(self.s, self.arrived, *reported, self.x["motor_speed"])
        declared = self.watch.declared
        self.position = self.position + self.by.on_its_way(declared.pending, declared.underway, self.load)
        self.full = both(self.full, ca.logic_not(self.verdicts[Verdict.SLOW]))

    def _order(self) -> None:
        """What is asked for, where it is something else than before."""
        ask, target, by = self.u["ask"], self.u["target"], self.by
        inside, sent, taken = self._asked()
        left = choose(self.visit.stays(), self.position, NOTHING)
        anew = {"reason": float(Reason.NONE), "place": NOTHING, "end": NOTHING, "stood": 0.0, "pushed": 0.0}
        self.happens(Event.SENT, sent, tries=float(by.tuning.tries), left=left, **anew)
        self.happens(Event.STEERED, taken, **anew)
        self.visit.order(**anew)
        self.s["target"] = choose(inside, target, choose(ask == float(Ask.POSITION), self.s["target"], NOTHING))
        self.s["ask"] = ask
        self.fail(ask == float(Ask.STOP), Reason.ASKED)

    def _judge(self) -> None:
        """Stop if the estimate is not to be relied on, unless a load is kept up, or a hand or a visit goes without.

        And if the drive is not; one that stalls may, against an end stop.
        """
        rests = self.doing(Activity.RESTING)
        placeless = ca.logic_or(self.s["place"] == NOTHING, float(not self.by.holding.stands))
        without = either(self.doing(Activity.MANUAL, Activity.HOMING), both(rests, placeless))
        homes = both(without, self.mended)
        lost = ca.logic_or(both(self.none, ca.logic_not(homes)), ca.logic_not(known(self.sensed["position"])))
        matters = ca.logic_or(ca.logic_not(rests), self.s["motor_speed"] != 0.0)
        presses = self.doing(Activity.MANUAL, Activity.HOMING)
        self.fail(both(lost, matters), Reason.SENSOR)
        for verdict, reason in STOPPED_BY.items():
            stops = both(self.verdicts[verdict], ca.logic_not(lost))
            self.fail(both(stops, ca.logic_not(presses)) if verdict is Verdict.STALLED else stops, reason)

    def _enter(self) -> None:
        """The first sample of an activity: a trajectory begins where the rod is, as fast as it goes."""
        s, fresh = self.s, self.s["fresh"]
        velocity = choose(s["motor_speed"] == 0.0, 0.0, self.sensed["velocity"])
        moves = both(fresh, self.doing(Activity.MOVING))
        steers = both(fresh, self.doing(Activity.MANUAL))
        s["direction"] = choose(moves, towards(s["target"] - self.position), s["direction"])
        self._begin(moves, velocity)
        s["lead_velocity"] = choose(steers, velocity, s["lead_velocity"])
        self.visit.enter()
        s["fresh"] = ca.SX(0.0)

    def _begin(self, when: Any, velocity: Any) -> None:
        places_now = begun(self.position, velocity, self.count, self.by.period)
        self.been = [choose(when, new, old) for new, old in zip(places_now, self.been, strict=True)]
        self.s["lead_velocity"] = choose(when, velocity, self.s["lead_velocity"])

    def _do(self) -> Any:
        """What the activity asks for; what follows it."""
        doing: dict[Activity, Any] = {one: self.doing(one) for one in ACTIVITIES}  # before anything follows
        self.s["used_slope"] = choose(doing[Activity.STOPPING], self.s["slope"], self.by.slope)
        goes, steered = self._steered(doing[Activity.MANUAL])
        held = self._held()
        wishes: dict[Activity, Any] = {
            Activity.MOVING: self._moved(doing[Activity.MOVING]),
            Activity.MANUAL: choose(goes, steered, held),
            Activity.LANDING: held,
            Activity.RESTING: held,
            Activity.HOMING: self.visit.step(doing[Activity.HOMING]),
        }
        self._landed(doing[Activity.LANDING])
        stands = abs(self.s["motor_speed"]) <= self.s["slope"] * self.by.period + 1e-9
        self.happens(Event.STANDS, both(doing[Activity.STOPPING], stands))
        wish: Any = ca.SX(0.0)
        for activity, asked in wishes.items():
            wish = choose(doing[activity], asked, wish)
        failed = both(ca.logic_not(doing[Activity.STOPPING]), self.doing(Activity.STOPPING))
        self.s["used_slope"] = choose(failed, self.s["slope"], self.s["used_slope"])
        return choose(failed, 0.0, wish)

    def _moved(self, moves: Any) -> Any:
        s, by, u = self.s, self.by, self.u
        push = by.may_push(s["direction"], self.load)
        share = choose(self.full, 1.0, by.tuning.slowed)
        allowed = most(least(u["speed"], by.limits.speed), by.tuning.creeping)
        fastest = push * least(share * allowed, by.reachable(self.load))
        lead = ahead(
            by.limits, by.unit.cylinder.stroke, self.been[0], s["lead_velocity"], s["target"], fastest, by.period
        )
        before = self.been
        self.been = [choose(moves, new, old) for new, old in zip([lead[0], *before[:-1]], before, strict=True)]
        s["lead_velocity"] = choose(moves, lead[1], s["lead_velocity"])
        self._begin(both(moves, self.verdicts[Verdict.AT_LIMIT]), self.sensed["velocity"])
        waits = both(moves, push == 0.0)
        self._begin(waits, 0.0)
        s["pushed"] = choose(waits, s["pushed"] + by.period, choose(moves, 0.0, s["pushed"]))
        place, velocity = smoothed(self.been, by.period) if self.count else (self.been[0], s["lead_velocity"])
        off = place - self.position
        remaining = s["direction"] * (s["target"] - self.position)
        near = remaining <= by.to_stand(s["motor_speed"], s["direction"], self.load)
        follows = both(moves, ca.logic_not(waits))
        astray = both(follows, abs(off) > by.tuning.following(by.limits))
        self.fail(both(waits, s["pushed"] > PUSHING), Reason.FORCE)
        self.fail(astray, Reason.ROD)
        landing = both(follows, near)
        self.happens(Event.NEAR, landing, place=s["target"], stood=0.0)
        load = leaving(by, place - s["left"], s["direction"], s["felt"], self.load)
        pursued = choose(near, 0.0, by.pursuing(velocity, off, s["direction"], load))
        return choose(waits, by.at_rest(0.0, self.load), pursued)

    def _steered(self, steers: Any) -> tuple[Any, Any]:
        """Whether a hand lets the rod go, and the motor speed for that."""
        s, by, u = self.s, self.by, self.u
        share = choose(self.none, by.tuning.homing_share, choose(self.full, 1.0, by.tuning.slowed))
        fastest = least(share * by.limits.speed, by.reachable(self.load))
        trusted = ca.logic_not(self.none)
        velocity = by.steering(s["lead_velocity"], u["steering"], self.position, fastest, trusted)
        direction = choose(velocity > 0.0, 1.0, -1.0)
        push = by.may_push(direction, self.load)
        velocity = choose(push == 0.0, 0.0, velocity)
        s["lead_velocity"] = choose(steers, velocity, s["lead_velocity"])
        goes = velocity != 0.0
        s["place"] = choose(both(steers, goes), NOTHING, s["place"])
        return goes, by.moving(push * abs(velocity), direction, self.load)

    def _held(self) -> Any:
        """Stand, or hold the place; where none is given, the first at which the position may be relied on."""
        s, by = self.s, self.by
        trusted = ca.logic_not(self.none)
        if by.holding.stands:
            return 0.0
        rests = self.doing(Activity.RESTING, Activity.LANDING)
        keeps = either(rests, both(self.doing(Activity.MANUAL), s["lead_velocity"] == 0.0))
        first = both(both(keeps, trusted), s["place"] == NOTHING)
        s["place"] = choose(first, self.position, s["place"])
        back = choose(trusted, by.back(s["place"] - self.position), 0.0)
        return choose(self.visit.stays(), self.visit.kept(), by.at_rest(back, self.load))

    def _landed(self, lands: Any) -> None:
        s, tuning = self.s, self.by.tuning
        stands = ca.logic_or(self.x["motor_speed"] == 0.0, float(not self.by.holding.stands))
        stood = choose(stands, s["stood"] + self.by.period, 0.0)
        s["stood"] = choose(lands, stood, s["stood"])
        settled = both(lands, s["stood"] >= tuning.settling + self.by.lag)
        missed = both(abs(s["target"] - self.position) > tuning.renewing, s["tries"] > 0.0)
        again = both(both(settled, missed), ca.logic_not(self.none))
        self.happens(Event.MISSED, again, tries=s["tries"] - 1.0, place=NOTHING, left=NOTHING, stood=0.0, pushed=0.0)
        self.happens(Event.SETTLED, both(settled, ca.logic_not(again)))
