"""End stops, recognised from torque and speed alone.

While the piston moves, the held pressure stays about what it was. On the stop of the lowered end the load leaves the
oil and the pressure collapses; on the lifted end's the chamber is compressed towards relief pressure. Either counts
only after a steady stretch, where the position may be at that stop, and once a visit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.sensor.books import Books
from ramsight.sensor.virtual_sensor import SensorGraph

_TURNING = 3.0  # rad/s
_SMOOTHING = 0.04  # s, of the manifold's pressure; the noise of a torque is 1 bar
_FINDING = 0.1  # s, of what it is compared with, until the stretch counts as steady; then ...
_LONGER, _KEEPING = 2.0, (0.3, 2.0)  # ... over the time in which a stop changes it, within these s
_STEADY, _STEADY_PRESSURE = 0.06, 3e5  # share and Pa by which a steady pressure may differ from the slow one
_STEADY_FOR = 0.4  # s
_FALL, _LEAST_HELD = 0.5, 15e5  # share of the slow pressure below which it has collapsed; Pa above which that counts
_NOTHING = 0.15  # share of the slow pressure that no load a machine lifts falls to
_EMPTY = -5e5  # Pa; what the torque seems to say when the other side alone turns the motor
_RISE, _RISE_PRESSURE = 1.12, 10e5  # share and Pa above the slow pressure
_HIGH, _HIGH_RISE = 0.93, 0.35  # shares of the relief setting: reached, or risen by, only on a stop


@dataclass(frozen=True)
class Signs:
    """What the pressure looks like.

    Attributes:
        low, top: as on the stop of the lowered or the lifted end.
        likely_low, likely_top: as hardly anywhere else, even without a steady stretch before.
        surely_low, surely_top: as nowhere else, even if nobody knows the position.
        gone: a steady pressure is gone: half of it while lowering, nearly all of it while lifting.
        slow: what it was before it changed [Pa].
        moving: whether the piston moves with the valve open.
    """

    low: Any
    top: Any
    likely_low: Any
    likely_top: Any
    surely_low: Any
    surely_top: Any
    gone: Any
    slow: Any
    moving: Any


class StopWatch:
    """Watches the pressure of one unit.

    Args:
        graph: the sensor's graph; gains states.
        books: of this sample.
        lift_sign: of the unit.
    """

    def __init__(self, graph: SensorGraph, books: Books, lift_sign: float) -> None:
        self._graph = graph
        self._slow, filtered, steady_for, moving_for = (
            graph.state(name) for name in ("slow_pressure", "filtered_pressure", "steady_for", "moving_for")
        )
        dt, up = graph.elapsed, lift_sign * graph.motor_speed
        opened = books.open > 0.5
        lifting, lowering = ca.logic_and(up > _TURNING, opened), ca.logic_and(up < -_TURNING, opened)
        self._moving = ca.logic_or(lifting, lowering)
        now = books.manifold_pressure
        share = ca.if_else(moving_for < 2.0 * _SMOOTHING, 1.0, dt / (_SMOOTHING + dt))
        self._pressure = ca.if_else(self._moving, filtered + share * (now - filtered), now)
        near = ca.fabs(self._pressure - self._slow) < _STEADY * ca.fabs(self._slow) + _STEADY_PRESSURE
        settled = steady_for > _STEADY_FOR
        waiting = ca.if_else(near, steady_for + dt, 0.0)
        # On a stop the pump changes the pressure of a closed volume; what takes much longer is no stop.
        volume = books.capacity + books.held.manifold_capacity
        taken = (
            volume * ca.fmax(self._slow, _LEAST_HELD) / ca.fmax(ca.fabs(books.held.delivered(graph.motor_speed)), 1e-9)
        )
        keeping = ca.fmin(ca.fmax(_LONGER * taken, _KEEPING[0]), _KEEPING[1])
        self._tau = ca.if_else(settled, keeping, _FINDING)
        graph.becomes("filtered_pressure", self._pressure)
        graph.becomes("moving_for", ca.if_else(self._moving, moving_for + dt, 0.0))
        graph.becomes("steady_for", ca.if_else(self._moving, ca.if_else(settled, steady_for, waiting), 0.0))

        collapsed = ca.logic_and(self._slow > _LEAST_HELD, self._pressure < _FALL * self._slow)
        # A lifting pump empties the other side, so that the torque alone tells that nothing is lifted any more.
        apparent = graph.state("apparent_pressure")
        apparent_1 = apparent + dt / (_SMOOTHING + dt) * (books.apparent_pressure - apparent)
        graph.becomes("apparent_pressure", apparent_1)
        nothing = ca.logic_and(self._slow > _LEAST_HELD, apparent_1 < _NOTHING * self._slow)
        empty = self._pressure < _EMPTY
        relief = books.held.side.relief.setting
        risen = self._pressure > _RISE * self._slow + _RISE_PRESSURE
        at_relief = self._pressure > _HIGH * relief
        high = ca.logic_or(at_relief, self._pressure > self._slow + _HIGH_RISE * relief)
        # Without a steady stretch before only what no load does counts, and only where a stop is expected.
        low = ca.logic_and(lowering, ca.logic_or(ca.logic_and(settled, collapsed), empty))
        top = ca.logic_and(lifting, ca.logic_or(ca.logic_and(settled, risen), at_relief))
        self.signs = Signs(
            low=low,
            top=top,
            likely_low=ca.logic_and(lowering, empty),
            likely_top=ca.logic_and(lifting, at_relief),
            surely_low=ca.logic_and(ca.logic_and(lowering, settled), empty),
            surely_top=ca.logic_and(ca.logic_and(lifting, settled), ca.logic_and(risen, high)),
            gone=ca.logic_and(settled, ca.if_else(lifting, nothing, collapsed)),
            slow=self._slow,
            moving=self._moving,
        )

    def close(self, on_stop: Any) -> None:
        """Let the slow pressure follow, except on a stop."""
        dt = self._graph.elapsed
        followed = self._slow + dt / (self._tau + dt) * (self._pressure - self._slow)
        follows = ca.logic_and(self._moving, ca.logic_not(on_stop))
        self._graph.becomes("slow_pressure", ca.if_else(follows, followed, self._slow))
