"""The watch over a drive as a graph: what `ramsight.control.watch` does with an object."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca

from ramsight.control.declared_graph import DeclaredGraph
from ramsight.control.repeats import runs
from ramsight.control.repeats_graph import UNSEEN, SpeedRepeatsGraph, runs_of, share_of
from ramsight.control.watch import MOVED, SAME, STALLED, STANDS, TREMBLE, Allowed, Verdict
from ramsight.duty.drive_response import DriveResponse
from ramsight.plant.either import both, choose, known, least, most
from ramsight.plant.unit import HydraulicUnit

_COUNTS = ("off", "slow", "missing", "torque_repeats", "limited", "stalled_for")
_SLEEPS = ("same", "gone", "model_mean", "asked_mean", "side")


class WatchGraph:
    """A watch over one drive.

    Args:
        unit: whose drive it is, as its data sheet has it.
        response: how the drive is declared to follow.
        period: of the samples [s].

    Attributes:
        initial: its states and their values at power-up.
        declared: the drive as declared.
    """

    def __init__(self, unit: HydraulicUnit, response: DriveResponse, period: float) -> None:
        self._may, self._response, self._period = Allowed.of(unit, response, period), response, period
        self.declared = DeclaredGraph(response, period, self._may)
        self._repeats = SpeedRepeatsGraph(response.speed_noise, response.speed_step, period)
        own = dict.fromkeys((*_COUNTS, *_SLEEPS), 0.0) | {"speed_before": UNSEEN, "torque_before": UNSEEN}
        if response.torque_repeats is None:
            own |= {"torques_seen": 0.0, "torques_met": 0.0}
        if self._may.servo is not None:
            own |= {"integral": 0.0}
        self.initial = own | self.declared.initial | self._repeats.initial

    def begin(self, s: dict[str, Any], when: Any) -> None:
        """Look anew, after a stop."""
        self._zero(s, when, *(name for name in _COUNTS))
        self._repeats.forget(s, when)
        self._zero(s, when, *_SLEEPS)

    def _zero(self, s: dict[str, Any], when: Any, *names: str) -> None:
        s |= {name: choose(when, 0.0, s[name]) for name in names}

    def look(self, s: dict[str, Any], arrived: Any, speed: Any, torque: Any, commanded: Any) -> dict[Verdict, Any]:
        """Whether each verdict is that of a sample; the states of `s` become the next ones.

        Args:
            s: the states.
            arrived: whether there is a report.
            speed: in it [rad/s].
            torque: in it [N m].
            commanded: what the drive was asked for until now [rad/s].
        """
        may, old = self._may, dict(s)
        self.declared.advance(s, commanded)
        s["missing"] = choose(arrived, 0.0, s["missing"] + 1.0)
        silent = both(ca.logic_not(arrived), s["missing"] > may.missing)
        numbers = both(arrived, both(known(speed), known(torque)))
        gives = self._gives_way(s, numbers, torque)
        low, high = self._range(may.late, gives)
        lacks = ca.logic_or(speed < low, speed > high)
        slept = ca.logic_or(self._slept(s, numbers, speed), self._speed_sticks(s, numbers, speed))
        sticks = self._torque_sticks(s, numbers, torque, speed)
        s["speed_before"] = choose(numbers, speed, old["speed_before"])
        s["torque_before"] = choose(numbers, torque, old["torque_before"])
        limited = self._at_limit(s, numbers, torque, lacks)
        stalls = self._stalls(s, numbers, limited, speed)
        free = both(numbers, ca.logic_not(limited))
        disobeys = self._disobeys(s, free, lacks, speed, gives)
        left = both(free, ca.logic_not(disobeys))
        stuck = both(disobeys, s["same"] >= may.in_a_row)
        ends = ca.logic_or(slept, sticks)
        goes = both(left, ca.logic_not(ends))
        s["slow"] = choose(goes, choose(lacks, s["slow"] + 1.0, 0.0), s["slow"])
        return {
            Verdict.SILENT: silent,
            Verdict.STALLED: stalls,
            Verdict.AT_LIMIT: both(limited, ca.logic_not(stalls)),
            Verdict.DISOBEYS: both(disobeys, ca.logic_not(stuck)),
            Verdict.STUCK: ca.logic_or(stuck, both(left, slept)),
            Verdict.TORQUE_STUCK: both(both(left, ca.logic_not(slept)), sticks),
            Verdict.SLOW: both(goes, s["slow"] >= may.in_a_row),
        }

    def _gives_way(self, s: dict[str, Any], when: Any, torque: Any) -> Any:
        """Speed by which a servo is below its reference, as its torque has it [rad/s]."""
        servo = self._may.servo
        if servo is None:
            return 0.0
        off = torque - s["integral"]
        share = 1.0 - math.exp(-servo.integral_gain / servo.proportional_gain * self._period)
        s["integral"] = choose(when, s["integral"] + share * off, s["integral"])
        return off / servo.proportional_gain

    def _range(self, late: int, gives: Any) -> tuple[Any, Any]:
        """Least and greatest speed that a drive could report that is up to so many samples late [rad/s]."""
        low, high = self.declared.spread(late)
        return low - most(gives, 0.0) - self._may.speed, high - least(gives, 0.0) + self._may.speed

    def _disobeys(self, s: dict[str, Any], when: Any, lacks: Any, speed: Any, gives: Any) -> Any:
        low, high = self._range(self._may.patience, gives)
        outside = both(lacks, ca.logic_not(both(low <= speed, speed <= high)))
        s["off"] = choose(when, choose(outside, s["off"] + 1.0, 0.0), s["off"])
        return both(both(when, lacks), s["off"] >= self._may.in_a_row)

    def _slept(self, s: dict[str, Any], when: Any, speed: Any) -> Any:
        """Whether the speed stood in the reports while all that must be in them by now went elsewhere."""
        may, repeats = self._may, both(when, speed == s["speed_before"])
        self._zero(s, both(when, ca.logic_not(repeats)), *_SLEEPS)
        s["same"] = s["same"] + repeats
        model, asked = self.declared.had(may.late)
        seen = s["same"] - may.late
        means = both(repeats, both(seen > 0.0, seen <= may.leaving))
        for name, value in (("model_mean", model), ("asked_mean", asked)):
            s[name] = choose(means, s[name] + value / may.leaving, s[name])
        off = model - s["model_mean"], asked - s["asked_mean"]
        far = MOVED * self._response.speed_step
        side = choose(least(*off) > far, 1.0, choose(most(*off) < -far, -1.0, 0.0))
        looks = both(repeats, seen > may.leaving)
        s["gone"] = choose(looks, choose(side == s["side"], s["gone"] + 1.0, 1.0), s["gone"])
        s["side"] = choose(looks, side, s["side"])
        return both(repeats, both(s["side"] != 0.0, s["gone"] >= may.leaving))

    def _speed_sticks(self, s: dict[str, Any], when: Any, speed: Any) -> Any:
        """Whether the speed of a motor that turns repeats more often than its noise lets it."""
        turns = abs(speed) >= STANDS
        self._repeats.forget(s, both(when, ca.logic_not(turns)))
        low, high = self.declared.spread(self._may.late + self._may.in_a_row)
        stands = high - low < SAME * self._response.speed_step
        trembles = both(ca.logic_not(stands), high - low < TREMBLE * self._response.speed_noise)
        return self._repeats.look(s, both(when, turns), speed, (stands, trembles))

    def _torque_sticks(self, s: dict[str, Any], when: Any, torque: Any, speed: Any) -> Any:
        """Whether a torque repeats more often than its noise lets it, while the motor turns."""
        looks = both(both(when, abs(speed) >= STANDS), s["torque_before"] != UNSEEN)
        repeats = both(looks, torque == s["torque_before"])
        declared, count = self._response.torque_repeats, s["torque_repeats"]
        if declared is None:
            ends = both(looks, ca.logic_not(repeats))
            s["torques_seen"] = s["torques_seen"] + choose(ends, 1.0 + count, 0.0)
            s["torques_met"] = s["torques_met"] + choose(ends, count, 0.0)
        s["torque_repeats"] = choose(repeats, count + 1.0, choose(when, 0.0, count))
        if declared is not None:
            return both(looks, s["torque_repeats"] >= runs(declared, self._period))
        share = share_of(s["torques_met"], s["torques_seen"])
        return both(both(looks, share < 1.0), s["torque_repeats"] >= runs_of(share, self._period))

    def _at_limit(self, s: dict[str, Any], when: Any, torque: Any, lacks: Any) -> Any:
        """Whether the drive has no torque for the speed that is missing, or had none just now."""
        if self._may.servo is None:
            return ca.SX(0.0)
        full = both(when, abs(torque) >= self._may.full)
        self._zero(s, full, *_SLEEPS)
        self._repeats.forget(s, full)
        left = choose(full, float(self._may.patience + self._may.in_a_row), most(s["limited"] - 1.0, 0.0))
        s["limited"] = choose(when, left, s["limited"])
        return both(when, both(s["limited"] > 0.0, lacks))

    def _stalls(self, s: dict[str, Any], when: Any, limited: Any, speed: Any) -> Any:
        """Whether it has been there for long without a turn."""
        longer = choose(abs(speed) < STANDS, s["stalled_for"] + self._period, 0.0)
        s["stalled_for"] = choose(when, choose(limited, longer, 0.0), s["stalled_for"])
        return both(limited, s["stalled_for"] > STALLED)
