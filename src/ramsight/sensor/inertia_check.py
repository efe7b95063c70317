"""The torque against the shaft's acceleration: a sign that is wrong shows whenever the motor speeds up or slows down.

What a load, a pump or a valve asks of the motor is unknown, but none of it follows the acceleration from one tenth of a
second to the next, and the inertia of motor and pumps does: where the acceleration steps, the torque steps by J times
that, up where it goes up. Both are taken through the same band-pass filter,

    y = F tau,      x = F J d omega/dt,      y ~ x,  and y ~ -x where the sign of either report is wrong

and the likelihoods of both are held against each other as long as the motor turns one way (at standstill friction
steps, too): a cumulative sum of -2 x y / s^2 that never falls below 0 (Page, 1954). A gain it cannot tell: what the
oil and the moved mass add to y is up to a third of x, and J itself is known by as much.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca

from ramsight.plant.limits import Limits
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.drive_check import DriveChecks
from ramsight.sensor.virtual_sensor import SensorGraph

ALARM = 18.0
"""Sum beyond which a sign is taken to be wrong: one false alarm in 1000 h, by evaluation/inertia.py."""
_FAST, _SLOW = 0.04, 0.15  # s; of the band-pass filter: a step of the acceleration, and no slope of the load
_TURNS = 8.0  # rad/s; slower, friction of the pumps may step
_LONGEST = 0.15  # s; a gap begins anew
_OTHER = 0.25  # of x, std: what oil and moved mass add to it, on recorded logs
_OUTSIDE = 2.0  # a step of the torque that is larger than this by x and y's noise is something else: a stop, a valve
_MOST = 6.0  # that one step adds
_MEMORY = 1.5  # of the alarm, beyond which the sum does not grow; it ends at half the alarm
_OVER = 0.5


def check_inertia(
    graph: SensorGraph, checks: DriveChecks, assumptions: Assumptions, limits: Limits, inertia: float
) -> DriveChecks:
    """What a drive's report says of itself, with what its ramps say of its signs; as it is where nothing is declared.

    Args:
        graph: the sensor's graph after its intake; gains states.
        checks: of counter and power.
        assumptions: of drive and inertia.
        limits: of the unit.
        inertia: of motor, belt and pumps at the motor shaft [kg m2].
    """
    declared = assumptions.inertia.std
    if declared == 0.0:
        return checks
    h = ca.fmax(graph.elapsed, 1e-3)
    turns = _turning(graph)
    asked = graph.parameters.add("inertia", inertia) * (graph.motor_speed - graph.last_speed) / h
    shown = 0.5 * (graph.motor_torque + graph.held("motor_torque"))
    x, y = (_band(graph, name, value, turns, h) for name, value in (("asked", asked), ("shown", shown)))
    noise = assumptions.drive.torque * limits.torque
    variance = noise**2 + (declared**2 + _OTHER**2) * x**2
    tells = ca.logic_and(ca.fabs(x) > noise, ca.fabs(y) < _OUTSIDE * ca.fabs(x) + noise)
    speaks = ca.fmin(ca.fmax(-2.0 * x * y / variance, -_MOST), _MOST)
    use = ca.logic_and(turns, tells)
    before, was = graph.state("reversed"), graph.state("reversed_alarm")
    grown = ca.fmin(ca.fmax(before + speaks * graph.elapsed / _SLOW, 0.0), _MEMORY * ALARM)
    now = ca.if_else(use, grown, before)
    alarm = now > ca.if_else(was, _OVER * ALARM, ALARM)
    graph.becomes("reversed", now)
    graph.becomes("reversed_alarm", alarm)
    more = {**checks.more, "sign_reversed": (now / ALARM, "1")}
    return replace(checks, sign_wrong=alarm, more=more, declared=True)


def _turning(graph: SensorGraph) -> Any:
    """Whether the motor has turned one way since the last sample but one."""
    w, last = graph.motor_speed, graph.last_speed
    one_way = ca.logic_and(ca.fmin(ca.fabs(w), ca.fabs(last)) > _TURNS, w * last > 0.0)
    follows = ca.logic_and(graph.elapsed > 0.0, graph.elapsed < _LONGEST)
    now = ca.logic_and(one_way, follows)
    before = graph.state("ramp_begun")
    graph.becomes("ramp_begun", now)
    return ca.logic_and(before, now)


def _band(graph: SensorGraph, name: str, value: Any, turns: Any, h: Any) -> Any:
    """What a fast filter has of a value and a slow one has not; both begin where the motor begins to turn."""
    ends = []
    for kind, constant in (("fast", _FAST), ("slow", _SLOW)):
        before = graph.state(f"{name}_{kind}")
        after = ca.if_else(turns, value + (before - value) * ca.exp(-h / constant), value)
        graph.becomes(f"{name}_{kind}", after)
        ends.append(after)
    return ends[0] - ends[1]
