"""The angle of the body that the cylinder turns, where a machine has a sensor for it: a reference that is always there.

An angle says the position by the triangle of cylinder and body (`ramsight.plant.linkage.lever`), with an error that
stays, which is a state of the filter, and one of vibration and acceleration. What repeats an error is no new evidence:
it is taken again after twice the time for which vibration stays what it is, and only once both the piston has gone and
the angle has changed by more than the error is wide. So a sensor that is stuck is not taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.plant.linkage.lever import Lever
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.load import LoadStep
from ramsight.sensor.virtual_sensor import LINK_ANGLE, SensorGraph

# Exponentially correlated errors carry as much as independent ones every two correlation times; not quite two, so that
# rounding of the usual sample periods decides nothing.
_APART = 2.1
_UNSURE = 0.5  # share of the lag that is not known


@dataclass(frozen=True)
class LinkSample:
    """What an angle says.

    Attributes:
        use: whether it is to be taken.
        place: where the piston is by it, now [m].
        by_offset: how that follows the angle's error [m/rad].
        variance: of the rest of its error [m2].
    """

    use: Any
    place: Any
    by_offset: Any
    variance: Any


class LinkAngle:
    """Its states in a sensor's graph.

    Args:
        graph: whose input it is; gains states.
        lever: what it says of the position.
        assumptions: of the sensor of the angle.
    """

    def __init__(self, graph: SensorGraph, lever: Lever, assumptions: Assumptions) -> None:
        self._graph, self._lever, self._assumed = graph, lever, assumptions.link_angle
        self._since, self._gone = graph.state("link_since"), graph.state("link_gone")
        self._last = graph.state("last_link_angle")

    def look(self, step: LoadStep, known: Any, other: Any) -> LinkSample:
        """What the sample's angle says, if it is to be taken.

        Args:
            step: of the load observer.
            known: whether a position is known at all.
            other: whether something better comes with this sample.
        """
        graph, assumed = self._graph, self._assumed
        given = graph.measured[LINK_ANGLE]
        there = ca.fabs(given) < math.pi
        angle = ca.if_else(there, given, 0.0)
        slope = self._lever.slope(angle)
        late = step.travel * assumed.lag / ca.fmax(graph.elapsed, 1e-3)
        error = (assumed.std * slope) ** 2
        since, gone = self._since + graph.elapsed, self._gone + step.travel
        moved = ca.logic_and(gone**2 > error, ca.fabs(angle - self._last) > assumed.std)
        fresh = ca.logic_and(since > _APART * assumed.correlation, moved)
        due = ca.logic_and(there, ca.logic_or(fresh, ca.logic_not(known)))
        use = ca.logic_and(due, ca.logic_not(other))
        graph.becomes("link_since", ca.if_else(use, 0.0, since))
        graph.becomes("link_gone", ca.if_else(use, 0.0, gone))
        graph.becomes("last_link_angle", ca.if_else(use, angle, self._last))
        place = self._lever.position(angle) + late
        return LinkSample(use, place, slope, error + (_UNSURE * late) ** 2)
