"""The angle of the body that the cylinder turns, where a machine has a sensor for it: a reference at any time.

An angle gives the position by the triangle of cylinder and body (`ramsight.plant.linkage.lever`), with an error that
persists, which is a state of the filter, and one of vibration and acceleration. What repeats an error is no new
evidence: the angle is used again after twice the time for which vibration is correlated, and only once both the piston
has moved and the angle has changed by more than the error. So a sensor that is stuck is not used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Condition, Flag, Scalar, all_of, any_of, negated
from ramsight.plant.linkage.lever import Lever
from ramsight.sensor.assumptions import AssumedLinkAngle
from ramsight.sensor.circuit.load_step import LoadStep
from ramsight.sensor.inputs.sample import LINK_ANGLE, Sample
from ramsight.sensor.thresholds import ANGLE_LAG_STD, ANGLE_REPEAT, SHORTEST_STEP


@dataclass(frozen=True, kw_only=True)
class LinkState:
    """The angle that was used last.

    Attributes:
        since: time since then [s].
        travel: of the piston since then [m].
        angle: [rad].
    """

    since: Scalar = leaf("s")
    travel: Scalar = leaf("m")
    angle: Scalar = leaf("rad")


@dataclass(frozen=True)
class LinkSample:
    """An angle as a measurement of the position.

    Attributes:
        use: whether it is to be used.
        place: where the piston is by it, now [m].
        by_offset: how that follows the angle's error [m/rad].
        variance: of the rest of its error [m2].
    """

    use: Flag
    place: Scalar
    by_offset: Scalar
    variance: Scalar


def read_angle(
    state: LinkState,
    sample: Sample,
    step: LoadStep,
    lever: Lever,
    assumed: AssumedLinkAngle,
    known: Flag,
    other: Condition,
) -> tuple[LinkState, LinkSample]:
    """The sample's angle, if it is to be used.

    Args:
        state: before the sample.
        sample: the sample.
        step: of the load observer.
        lever: position over angle.
        assumed: of the sensor of the angle.
        known: whether a position is known at all.
        other: whether a better measurement comes with this sample.
    """
    reported = sample.measured[LINK_ANGLE]
    there = ca.fabs(reported) < math.pi
    angle = ca.if_else(there, reported, 0.0)
    slope: Scalar = lever.slope(angle)
    travel = step.motion.travel
    late = travel * assumed.lag / ca.fmax(sample.elapsed, SHORTEST_STEP)
    error = (assumed.std * slope) ** 2
    since, gone = state.since + sample.elapsed, state.travel + travel
    moved = all_of(gone**2 > error, ca.fabs(angle - state.angle) > assumed.std)
    fresh = all_of(since > ANGLE_REPEAT * assumed.correlation, moved)
    due = all_of(there, any_of(fresh, negated(known)))
    use = all_of(due, negated(other))
    after = LinkState(
        since=ca.if_else(use, 0.0, since),
        travel=ca.if_else(use, 0.0, gone),
        angle=ca.if_else(use, angle, state.angle),
    )
    place = lever.position(angle) + late
    return after, LinkSample(use, place, slope, error + (ANGLE_LAG_STD * late) ** 2)
