"""Whether to believe a position, and why not: the conditions behind each status."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.plant.ddh import DdhUnit
from ramsight.sensor.books import Books
from ramsight.sensor.intake import Intake
from ramsight.sensor.references import Found
from ramsight.sensor.status import Status
from ramsight.sensor.stops import StopWatch
from ramsight.sensor.virtual_sensor import SensorGraph

COLDEST, HOTTEST = 243.15, 383.15  # K; -30 ... 110 degC, where the Walther equation joins two points well
NEAR_RELIEF = 0.97  # share of the relief setting above which flow may be lost, [G]
AT_RELIEF = 0.99  # share of the setting from which oil is taken to pass; the noise of the pressure is 0.2 %
STOP_ZONE = 0.02  # share of the stroke; so near the lift's end the relief valve opens because of the stop
_OVERSPEED = 1.05  # share of the highest speed
_WARNING, _LIMIT = 0.01, 0.1  # shares of the stroke: standard deviation at which a reference is due, or overdue
_BEYOND = 4.0  # standard deviations outside the stroke
_BEYOND_LEAST = 5e-3  # m
_PRESSURE_SMOOTHING = 0.1  # s
_EMPTY = -3e5  # Pa; below it the torque says that the held side is empty, noise is 1 bar
_IMPOSSIBLE = -25e5  # Pa; no pump draws so much, so the torque's sign or offset is wrong
_ABOVE_RELIEF = 1.2  # share of the relief setting that no manifold reaches
_LASTS, _LONG = 0.15, 0.6  # s, after which it is no noise, or no transient of the books
_RESTING = 1.5  # s of rest, after which manifolds have leaked empty
_RESTING_TORQUE = 0.06  # share of the torque at relief pressure
_RESTING_SMOOTHING = 0.5  # s
_SLIP = 0.5  # share of the pump's flow that may be gone while the relief valve is open


@dataclass(frozen=True)
class Verdict:
    """The status, and how far the piston may have slipped unseen at this sample [m]."""

    code: Any
    slipped: Any


def judge(
    graph: SensorGraph,
    books: Books,
    intake: Intake,
    found: Found,
    std: Any,
    position: Any,
    unit: DdhUnit,
    watch: StopWatch,
    on_stop: Any,
) -> Verdict:
    """Judge a sample.

    Args:
        graph: the sensor's graph; gains states.
        books: of this sample.
        intake: its conditions.
        found: its references.
        std: of the position [m].
        position: [m], perhaps outside the stroke.
        unit: the unit's parts.
        watch: the pressure's signs.
        on_stop: whether the piston rests on an end stop, or is just leaving one.
    """
    stroke, relief = books.cylinder.stroke, books.held.side.relief.setting
    dt, w = graph.elapsed, graph.motor_speed
    turning = books.turning > 0.5
    free = ca.logic_not(ca.logic_or(on_stop, found.sign))

    def lasting(name: str, condition: Any, least: float = _LASTS) -> Any:
        since = graph.state(name)
        since_1 = ca.if_else(condition, since + dt, 0.0)
        graph.becomes(name, since_1)
        return since_1 > least

    smooth = graph.state("judged_pressure")
    smooth_1 = smooth + dt / (_PRESSURE_SMOOTHING + dt) * (books.manifold_pressure - smooth)
    graph.becomes("judged_pressure", smooth_1)

    near = ca.logic_and(ca.fmax(books.held_pressure, books.other_pressure) > NEAR_RELIEF * relief, free)
    away = stroke - books.travel > ca.fmax(STOP_ZONE * stroke, 3.0 * std)
    opens = ca.logic_and(books.highest_pressure > AT_RELIEF * relief, ca.logic_and(turning, watch.signs.moving))
    opens = ca.logic_and(opens, ca.logic_and(away, free))

    moves = ca.logic_and(watch.signs.moving, free)
    drawn = ca.logic_or(smooth_1 < _EMPTY, watch.signs.gone)
    empty = lasting("empty_for", ca.logic_and(moves, drawn))
    below_tank = lasting("below_tank_for", ca.logic_and(moves, books.held_pressure < _EMPTY), _LONG)
    empty = ca.logic_or(empty, below_tank)
    wrong = ca.logic_or(smooth_1 < _IMPOSSIBLE, smooth_1 > _ABOVE_RELIEF * relief)
    implausible = lasting("implausible_for", ca.logic_and(ca.logic_and(turning, free), wrong))
    # Oil through the relief valve or from the tank, and a pressure that cannot be, leave the position in doubt.
    doubted = graph.state("doubted")
    doubtful = ca.logic_or(empty, implausible)
    graph.becomes("doubted", doubtful)
    passes = ca.logic_or(opens, doubtful)
    goes_on = lasting("doubtful_for", doubtful, _LONG)
    lost = graph.lost(ca.logic_or(opens, ca.logic_or(goes_on, implausible)), found.taken)
    slipped = ca.if_else(passes, _SLIP * ca.fabs(graph.angle) * unit.travel_per_radian, 0.0)
    begins = ca.logic_and(doubtful, ca.logic_not(doubted))
    slipped += ca.if_else(begins, books.capacity / books.held.area * ca.fmax(watch.signs.slow, 0.0), 0.0)
    rests = lasting("resting_for", ca.logic_not(turning), _RESTING)
    at_rest = graph.state("resting_torque")
    excess = graph.motor_torque - books.other.torque_per_pressure(0.0) * books.other_pressure
    at_rest_1 = ca.if_else(rests, at_rest + dt / (_RESTING_SMOOTHING + dt) * (excess - at_rest), 0.0)
    graph.becomes("resting_torque", at_rest_1)
    lifting = ca.fabs(books.held.torque_per_pressure(1.0))
    offset = ca.logic_and(free, ca.fabs(at_rest_1) > _RESTING_TORQUE * lifting * relief)

    beyond = ca.fmax(-position, position - stroke)
    outside = beyond > _BEYOND * std + _BEYOND_LEAST
    extreme = ca.logic_or(graph.oil_temperature < COLDEST, graph.oil_temperature > HOTTEST)
    rising = [
        (std > _WARNING * stroke, Status.REFERENCE_DUE),
        (extreme, Status.OUTSIDE_TEMPERATURE),
        (ca.fabs(w) > _OVERSPEED * unit.max_speed, Status.OUTSIDE_SPEED),
        (intake.cold, Status.TEMPERATURE_LOST),
        (near, Status.NEAR_RELIEF),
        (empty, Status.CAVITATION),
        (intake.gap, Status.INPUT_GAP),
        (found.disputed, Status.REFERENCE_REFUSED),
        (lost, Status.POSITION_LOST),
        (ca.logic_not(found.referenced), Status.NOT_REFERENCED),
        (ca.logic_and(found.referenced, std > _LIMIT * stroke), Status.TOO_UNCERTAIN),
        (ca.logic_and(found.referenced, outside), Status.OUTSIDE_STROKE),
        (ca.logic_or(ca.logic_or(implausible, offset), intake.overtorque), Status.IMPLAUSIBLE_TORQUE),
        (intake.overspeed, Status.IMPLAUSIBLE_SPEED),
        (intake.stuck, Status.INPUT_STUCK),
        (intake.frozen, Status.TIME_FROZEN),
        (intake.lost, Status.INPUT_LOST),
    ]
    code = float(Status.OK)
    for condition, status in rising:
        code = ca.if_else(condition, float(status), code)
    return Verdict(code, slipped)
