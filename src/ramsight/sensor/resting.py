"""What moves a rod at rest, and nothing tells the sensor: a load that changes, valves that leak, oil that cools."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.plant.limits import limits_of
from ramsight.plant.oil import MINERAL_EXPANSION, trapped_expansion
from ramsight.plant.unit import HydraulicUnit
from ramsight.plant.valve import CLOSED_POINT
from ramsight.sensor.assumptions import AssumedMachine
from ramsight.sensor.load import SEEN_AT, LoadStep
from ramsight.sensor.mixture import CERTAIN
from ramsight.sensor.virtual_sensor import SensorGraph

_FIRST_LOOK = 0.3  # s after the torque shows the load again, when it is known
_LEARNING = 1.0 / 6.0  # share of the newest load change in their mean square
# That mean square is known by 2/share - 1 = 11 changes: with 95 % it is no more than 11 over the 5 % quantile of
# chi-squared of 11, 4.575, times as large. By its root:
SURELY = 1.55
_TURNING = 1.0  # rad/s


def creep(
    graph: SensorGraph, unit: HydraulicUnit, load: Any, viscosity: Any, warming: Any, machine: AssumedMachine
) -> Any:
    """By how much the position's standard deviation grows while a closed valve holds the load [m].

    Closed valves leak by a rate that nobody knows and that stays, and the oil that is shut in changes its volume with
    its temperature, by more than is described or, where nothing is described, as mineral oil does. Both errors go one
    way all the time, so deviations are added up and not their squares.

    Args:
        graph: the sensor's graph.
        unit: the unit.
        load: over what the relief valves carry [1].
        viscosity: of the oil [m2/s].
        warming: of the oil [K/s].
        machine: how far it may be from its description.
    """
    area = float(unit.cylinder.area(unit.held))
    pressure = limits_of(unit).pressure * ca.fmin(ca.fabs(load), 1.0)
    leaks = machine.closed_leakage * CLOSED_POINT * pressure / viscosity / area * graph.elapsed
    height = graph.position if unit.held == "a" else unit.cylinder.stroke - graph.position
    dead = float(unit.cylinder.dead_volume(unit.held)) / area
    per_kelvin = trapped_expansion(graph.oil_temperature, MINERAL_EXPANSION) * (ca.fmax(height, 0.0) + dead)
    share = machine.expansion if unit.oil.expansion is not None else math.hypot(1.0, machine.expansion)
    return leaks + share * per_kelvin * ca.fabs(warming) * graph.elapsed


@dataclass(frozen=True)
class UnseenLoad:
    """By how much a load change that has not been seen may have moved the rod; 0 while the load is seen.

    Attributes:
        std: standard deviation [m].
        most: what is exceeded as seldom as the position's bound [m].
    """

    std: Any
    most: Any


def unseen_load(graph: SensorGraph, step: LoadStep, held: Any, expected: Any, furthest: Any) -> UnseenLoad:
    """What a load that changes while nothing shows it may do to the position.

    The changes seen so far say how large the next one usually is, as well as a dozen of them can, and nothing of a rare
    one: for the bound it is taken for no less than expected at first, but for no more than what relief valves carry.

    Args:
        graph: the sensor's graph; gains states, among them the mean square of the load changes seen so far.
        step: of the load observer.
        held: whether the piston is held on a stop, where a load does not move it.
        expected: a load change before any has been seen, standard deviation [N].
        furthest: that a load can be from the one seen last [N].
    """
    shown_for, before, was_seen = (graph.state(name) for name in ("load_shown_for", "load_seen", "load_was_seen"))
    changes = graph.state("load_changes")  # mean square over the expected one, less 1: all states may begin at 0
    shows = ca.logic_and(step.seen > SEEN_AT, ca.fabs(graph.motor_speed) > _TURNING)
    shown_for_1 = ca.if_else(shows, shown_for + graph.elapsed, 0.0)
    sees = shown_for_1 > _FIRST_LOOK
    learns = ca.logic_and(ca.logic_and(sees, shown_for <= _FIRST_LOOK), was_seen)
    mean_square = 1.0 + changes
    newest = ((step.load - before) / expected) ** 2
    learnt = mean_square + ca.if_else(learns, _LEARNING * (newest - mean_square), 0.0)
    graph.becomes("load_shown_for", shown_for_1)
    graph.becomes("load_changes", learnt - 1.0)
    graph.becomes("load_seen", ca.if_else(sees, step.load, before))
    graph.becomes("load_was_seen", ca.fmax(was_seen, sees))
    unseen = ca.logic_not(ca.logic_or(shows, held))
    usual = expected * ca.sqrt(ca.fmax(learnt, 0.0))
    most = ca.fmin(CERTAIN * ca.fmax(usual, expected), furthest)
    return UnseenLoad(ca.if_else(unseen, step.give * SURELY * usual, 0.0), ca.if_else(unseen, step.give * most, 0.0))
