"""How a loop is set up, and the references that it takes by itself."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ramsight.closed_loop.planning import Knowledge, Visit, due, expected, plan
from ramsight.closed_loop.thresholds import LOAD_SAMPLES, LOAD_SPEED
from ramsight.control.position import PositionControl
from ramsight.control.trajectory import Limits
from ramsight.duty.drive_report import DriveReport
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.machine.assumption_description import SURE_START
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate, VirtualSensor

ASKS = frozenset(
    {
        Status.REFERENCE_DUE,
        Status.POSITION_LOST,
        Status.FAULT_PASSED,
        Status.NOT_REFERENCED,
        Status.TOO_UNCERTAIN,
        Status.OUTSIDE_STROKE,
    }
)
"""Statuses that only a reference clears."""


@dataclass(frozen=True)
class Referencing:
    """Which references are taken between moves, and when.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.closed_loop.referencing import LoopSettings
        >>> from ramsight.closed_loop.loop import UnitLoop
        >>> from ramsight.plant.build import build
        >>> axis = build(machine.load_machine("eha-test-bench").unit("axis"), "axis")
        >>> both = Referencing({"axis": (Visit(lifted=False), Visit(lifted=True))})
        >>> loop = UnitLoop(axis, axis, 0.1, 10e3, LoopSettings(known=True, referencing=both))
        >>> f"{loop.reference_due('axis', [0.15, 0.05]):.0f} s of such moves are left"
        '2 s of such moves are left'
        >>> for target in (0.15, 0.05, 0.15, 0.05):
        ...     loop.go({"axis": target})
        >>> loop.stopped, len(loop.visited)
        (False, 2)
    """

    # visits: that may be made, by unit; a unit that is not among them is never sent to an end stop
    visits: Mapping[str, Sequence[Visit]]
    # limit: standard deviation of the position that no move may reach [m]; by default 1 % of the stroke, at which
    # sensors report that a reference is due
    limit: float | None = None

    def largest(self, control: PositionControl) -> float:
        """The standard deviation that no move of a cylinder may reach [m]."""
        unit = control.unit
        return unit.assumptions.integrity.due * unit.cylinder.stroke if self.limit is None else self.limit

    def before(
        self,
        sensor: VirtualSensor,
        control: PositionControl,
        estimates: Sequence[Estimate],
        target: float,
        visits: Sequence[Visit],
    ) -> Visit | None:
        """The visit to make before a move, if any: one that pays, where it is due by the end of the move.

        A sensor that asks for a reference gets one: if none pays by what is known, the quickest.

        Args:
            sensor: of the cylinder.
            control: of it.
            estimates: until now.
            target: of the move [m].
            visits: that may be made.
        """
        if not visits:
            return None
        load, here, known = felt(estimates), place(estimates, control), Knowledge.of(sensor, control)
        left = due(known, control, here, [(target, load), (here, load)], self.largest(control))
        asks, work = estimates[-1].status in ASKS, [(target, load)]
        if not asks and left >= abs(target - here) / control.limits.speed:
            return None
        pays = plan(known, control, here, load, work, visits, 1).visits
        if pays or not asks:
            return pays[0] if pays else None
        return min(visits, key=lambda one: expected(known, control, here, load, work, [one]).cost)


def place(estimates: Sequence[Estimate], control: PositionControl) -> float:
    """Where a rod is, to plan with [m]: in the middle of the stroke as long as that is unknown."""
    position = estimates[-1].position
    return 0.5 * control.unit.cylinder.stroke if math.isnan(position) else position


def felt(estimates: Sequence[Estimate]) -> float:
    """The load that a rod has felt while it moved lately, the median [N]; that of now if it did not."""
    moving = [one.load for one in estimates[-int(LOAD_SAMPLES) :] if abs(one.velocity) > LOAD_SPEED]
    return float(np.median(moving)) if moving else estimates[-1].load


USUAL = DriveReport()
"""What a usual CANopen drive reports: whole rpm, a torque with a noise of 0.5 N m."""


class Feedback(Enum):
    """Where a control takes the position from."""

    SENSOR = "virtual sensor"
    TRUTH = "true position"
    REAL = "position sensor with a noise of 0.5 mm"


@dataclass(frozen=True)
class LoopSettings:
    """How a loop is set up; what all its units share.

    Example:
        >>> LoopSettings(known=True, period=0.01).oil_temperature
        313.15
    """

    # known: whether the sensors start with a known position, which is right; otherwise they have to be homed
    known: bool = False
    oil_temperature: float = T40  # [K]
    temperature_offset: float = 0.0  # by which the thermometers read too much [K]
    feedback: Feedback = Feedback.SENSOR  # where the controls take the position from
    seed: int = 0  # of the drives' and the position sensors' noise
    # assumptions: what the sensors assume of the machine; by default what each unit declares, and that a known
    # position is not wrong
    assumptions: Assumptions | None = None
    limits: Mapping[str, Limits] | None = None  # by unit; by default `Limits.of`
    period: float = SAMPLE_PERIOD  # of the samples [s]
    drive: DriveResponse = IDEAL  # how the drives follow their commands and report
    declared: DriveResponse | None = None  # how the controls take them to do that; by default as they do
    # report: rounding and noise of what the drives report; seed and the thermometers' offset are those above. What
    # the controls take them for is in `DriveResponse`
    report: DriveReport = USUAL
    # referencing: references that `go` takes before a move by which they are due; by default none
    referencing: Referencing | None = None

    def assumed_of(self, unit: HydraulicUnit) -> Assumptions:
        """What the sensor of a unit assumes."""
        if self.assumptions is not None:
            return self.assumptions
        return unit.assumptions.replace(SURE_START) if self.known else unit.assumptions
