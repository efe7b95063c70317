"""Readings of the position at any time: occasional ones, and the angle of the body that the cylinder turns.

A draw wire, a laser, a camera or a scale that somebody reads says

    z = x - v T + b + e

with the delay T at the velocity v, an error b that all readings share, and the reading's own error e; or it is of
something else. An own error stays what it is for a while: a reading is used again after twice that time.

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
from ramsight.expression import Flag, Scalar, all_of, any_of, negated
from ramsight.machine.assumption_description import AssumedReading
from ramsight.plant.linkage.lever import Lever
from ramsight.sensor.belief.measurement import BY_PLACE, Measurement
from ramsight.sensor.circuit.load_step import LoadStep
from ramsight.sensor.inputs.sample import LINK_ANGLE, Sample, lasted
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.thresholds import INDEPENDENT, LAG_STD, SHORTEST_STEP


def read_position(
    name: str, since: Scalar, sample: Sample, step: LoadStep, stands: Scalar, stroke: Scalar, assumed: AssumedReading
) -> tuple[Scalar, Measurement]:
    """The time since the last reading that was used [s], and the measurement of one that comes with a sample.

    Args:
        since: time before the sample since the last one that was used; a long one before the first [s].
        sample: the sample; a reading that is no number, or no place near the cylinder, is none.
        stands: nominal position [m].
        stroke: of the cylinder [m].
    """
    reported = sample.measured[name]
    there = all_of(reported > -stroke, reported < 2.0 * stroke)
    since = since + sample.elapsed
    use = all_of(there, lasted(since, INDEPENDENT * assumed.correlation))
    late = step.motion.travel * assumed.delay / ca.fmax(sample.elapsed, SHORTEST_STEP)
    measurement = Measurement(
        use=use,
        innovation=ca.if_else(there, reported, 0.0) + late - stands,
        H={Quantity.POSITION: 1.0},
        R=assumed.std**2 + (LAG_STD * late) ** 2,
        alternative=ca.log(assumed.wrong / stroke),
        teaches=BY_PLACE,
        common=assumed.offset,
        stands=(stands, stroke),
    )
    return ca.if_else(use, 0.0, since), measurement


@dataclass(frozen=True, kw_only=True)
class LinkState:
    """The angle that was used last."""

    since: Scalar = leaf("s")  # time since then [s]
    travel: Scalar = leaf("m")  # of the piston since then [m]
    angle: Scalar = leaf("rad")  # [rad]


def read_angle(
    state: LinkState,
    sample: Sample,
    step: LoadStep,
    stands: Scalar,
    known: Flag,
    lever: Lever,
    model: MachineModel,
) -> tuple[LinkState, Measurement]:
    """The angle that was used last, and the measurement of one that comes with a sample.

    Args:
        stands: nominal position [m].
    """
    assumed = model.assumed.link_angle
    reported = sample.measured[LINK_ANGLE]
    there = ca.fabs(reported) < math.pi
    angle = ca.if_else(there, reported, 0.0)
    slope: Scalar = lever.slope(angle)
    travel = step.motion.travel
    late = travel * assumed.lag / ca.fmax(sample.elapsed, SHORTEST_STEP)
    error = (assumed.std * slope) ** 2
    since, gone = state.since + sample.elapsed, state.travel + travel
    moved = all_of(gone**2 > error, ca.fabs(angle - state.angle) > assumed.std)
    fresh = all_of(lasted(since, INDEPENDENT * assumed.correlation), moved)
    use = all_of(there, any_of(fresh, negated(known)))
    after = LinkState(
        since=ca.if_else(use, 0.0, since),
        travel=ca.if_else(use, 0.0, gone),
        angle=ca.if_else(use, angle, state.angle),
    )
    measurement = Measurement(
        use=use,
        innovation=lever.position(angle) + late - stands,
        H={Quantity.POSITION: 1.0, Quantity.ANGLE_OFFSET: slope},
        R=error + (LAG_STD * late) ** 2,
        alternative=ca.log(model.assumed.stops.lies / model.stroke),
        teaches=BY_PLACE,
        stands=(stands, model.stroke),
    )
    return after, measurement
