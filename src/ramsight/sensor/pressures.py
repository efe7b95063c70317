"""Chambers' pressures that are measured, where a machine has sensors for them.

While the piston goes they say the load, beside the torque; while it stands they say how much oil has leaked, which the
load does not. A sensor's lag is followed: what it shows is held against what it would show of the believed pressure.
"""

from __future__ import annotations

import math
from typing import Any

import casadi as ca

from ramsight.plant.balance import Balance, Solution
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.drive_check import TURNS
from ramsight.sensor.virtual_sensor import MEASURABLE, PRESSURES, SensorGraph

_SETTLES = 1.0  # s, within which the oil of a standing piston takes the pressure that is shown; errors are shorter
_SHOWN = 0.5  # share of a pressure that the torque shows, from which on one is held against the other


def measured_pressures(assumptions: Assumptions) -> tuple[str, ...]:
    """The pressures that a sensor is given: both or none."""
    return PRESSURES if assumptions.pressure.std > 0.0 else ()


class MeasuredPressures:
    """Their states in a sensor's graph.

    Args:
        graph: whose inputs they are; gains states.
        balance: of the unit.
        assumptions: of the pressure sensors.
    """

    def __init__(self, graph: SensorGraph, balance: Balance, assumptions: Assumptions) -> None:
        self._graph, self._balance, self._assumed = graph, balance, assumptions.pressure
        cylinder = balance.unit.cylinder
        self._place = [balance.states.index(f"pressure_{node}") for node in (cylinder.node_a, cylinder.node_b)]
        self._shown = [graph.state(f"shown_{name}") for name in PRESSURES]
        self._begun, self._stood = graph.state("pressures_begun"), graph.state("stood")
        self._leaked = [graph.state(f"leaked_{name}") for name in PRESSURES]
        self._taken = [graph.state(f"taken_{name}") for name in PRESSURES]
        self._came = graph.state("load_variance_when_it_came_to_stand")
        known, otherwise = assumptions.machine, assumptions.machine.leaks_otherwise
        self._leak_std = math.sqrt((1.0 - otherwise) * known.leak**2 + otherwise * known.other_leak**2)
        self._measured = [graph.measured[name] for name in PRESSURES]
        self._force_std = math.hypot(cylinder.area_a, cylinder.area_b) * self._assumed.std
        self._known = [ca.fabs(value) < MEASURABLE for value in self._measured]

    def settled(self, before: Any, h: Any) -> Any:
        """The states before a sample, with the pressures of a piston that stands nearer to what is shown.

        The pressure is known as well as the load was when the piston came to stand, and as what leaked since, as well
        as the leakage; what is shown as well as its sensor, whose error stays. Of the difference the pressure takes the
        share of the first one's variance in both.
        """
        values, c = ca.vertsplit(before), self._balance.unit.cylinder
        share = h / (_SETTLES + h)
        for k, (place, area) in enumerate(zip(self._place, (c.area_a, c.area_b), strict=True)):
            variance = self._came / area**2 + (self._leak_std * self._leaked[k]) ** 2
            due = variance / (variance + self._assumed.std**2) * (self._measured[k] - self._shown[k] + self._taken[k])
            counts = ca.logic_and(ca.logic_and(self._known[k], self._stood), self._begun)
            moved = ca.if_else(counts, share * (due - self._taken[k]), 0.0)
            values[place] = values[place] + moved
            self._shown[k] = self._shown[k] + moved
            self._taken[k] = self._taken[k] + moved
        self._settled = [values[place] for place in self._place]
        return ca.vertcat(*values)

    def correction(self, solution: Solution, by_load: Any, variance: Any, h: Any) -> tuple[Any, Any]:
        """What the pressures add to the load [N], and its variance after that [N2].

        Args:
            solution: of the step, under the load as believed before it.
            by_load: how its states follow the load of a piston that goes.
            variance: of the load.
            h: the step [s].
        """
        c = self._balance.unit.cylinder
        lag = h / (self._assumed.lag + h)
        missed: Any = 0.0
        slope: Any = 0.0
        for k, (place, area) in enumerate(zip(self._place, (c.area_a, -c.area_b), strict=True)):
            would = self._shown[k] + lag * (solution.z[place] - self._shown[k])
            missed = missed + area * (self._measured[k] - would)
            slope = slope + lag * area * by_load[place]
        gain = variance * slope / (slope**2 * variance + self._force_std**2)
        counts = ca.logic_and(ca.logic_and(*self._known), ca.logic_and(self._begun, ca.logic_not(solution.stands)))
        gain = ca.if_else(counts, gain, 0.0)
        return gain * missed, (1.0 - gain * slope) * variance

    def torque_over(
        self, solution: Solution, by_load: Any, torque_by_load: Any, missed: Any, held: Any
    ) -> tuple[Any, Any]:
        """Torque that is reported beyond what the pressures ask of the pump [N m], 0 where they do not say.

        Beside it the standard deviation that errors of the pressures give it.

        Args:
            solution: of the step, under the load as believed before it.
            by_load: how its states follow the load of a piston that goes.
            torque_by_load: how its torque follows that load [m].
            missed: the reported torque less the solution's [N m].
            held: whether the piston is held where it is.
        """
        c, graph = self._balance.unit.cylinder, self._graph
        per_angle = graph.parameters.symbol("travel_per_radian")
        force: Any = 0.0
        slope: Any = 0.0
        for k, (place, area) in enumerate(zip(self._place, (c.area_a, -c.area_b), strict=True)):
            force = force + area * (self._measured[k] - solution.z[place])
            slope = slope + area * by_load[place]
        # Behind a valve that is shut, and while the motor hardly turns, the torque shows no pressure.
        shows = ca.logic_and(ca.fabs(torque_by_load) > _SHOWN * per_angle, ca.fabs(graph.motor_speed) > TURNS)
        shows = ca.logic_and(ca.logic_and(shows, ca.logic_not(held)), ca.fabs(slope) > _SHOWN)
        shows = ca.logic_and(ca.logic_and(*self._known), ca.logic_and(self._begun, shows))
        per_force = ca.if_else(shows, torque_by_load / slope, 0.0)
        return ca.if_else(shows, missed - per_force * force, 0.0), ca.fabs(per_force) * self._force_std

    def close(self, z: Any, stands: Any, h: Any, load_variance: Any) -> None:
        """What the sensors show after the sample, whether the piston stood, and how well the load was known [N2]."""
        lag = h / (self._assumed.lag + h)
        for k, (name, place) in enumerate(zip(PRESSURES, self._place, strict=True)):
            first = ca.if_else(self._known[k], self._measured[k], z[place])
            later = self._shown[k] + lag * (z[place] - self._shown[k])
            self._graph.becomes(f"shown_{name}", ca.if_else(self._begun, later, first))
            since = self._leaked[k] + z[place] - self._settled[k]
            self._graph.becomes(f"leaked_{name}", ca.if_else(stands, since, 0.0))
            self._graph.becomes(f"taken_{name}", ca.if_else(stands, self._taken[k], 0.0))
        self._graph.becomes("pressures_begun", 1.0)
        self._graph.becomes("load_variance_when_it_came_to_stand", ca.if_else(stands, self._came, load_variance))
        self._graph.becomes("stood", stands)
