"""An occasional reading of the position: a draw wire, a laser, a camera, a scale that somebody reads.

    z = x - v T + b + e

with the delay T at the velocity v, an error b that all readings share, and the reading's own error e; or it is of
something else. An own error stays what it is for a while: a reading is used again after twice that time.
"""

from __future__ import annotations

import casadi as ca

from ramsight.expression import Scalar, all_of
from ramsight.machine.assumption_description import AssumedReading
from ramsight.sensor.belief.measurement import BY_PLACE, Measurement
from ramsight.sensor.circuit.load_step import LoadStep
from ramsight.sensor.inputs.sample import Sample, lasted
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
