"""The sensor along the reports of many machines, several side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ramsight.arrays import Array
from ramsight.engine.recursion import replay_many
from ramsight.sensor.virtual_sensor import BOUND, VirtualSensor
from ramsight.study.datasheet.drawn import Drawn
from ramsight.study.datasheet.measuring import SETTLED, Track
from ramsight.tracking.position_errors import stop_visits

_POWER_UP = 5.0  # s after the first stop, up to which a sensor that was started without a position is looked at


@dataclass(frozen=True)
class Run:
    """One machine's duty done: truth, and what its drive reported."""

    drawn: Drawn
    time: Array  # [s], shape (samples,)
    true: Array  # position [m]
    inputs: Array  # of the sensor, shape (samples, inputs)
    start: float  # the sensor's start position [m]
    # motor speed [rad/s], motor torque [N m] and oil temperature [K] as they are
    true_signals: tuple[Array, Array, Array]

    @property
    def stroke(self) -> float:
        """Stroke of the cylinder as it is built [m]."""
        return float(self.drawn.unit.cylinder.stroke)

    @property
    def visits(self) -> Array:
        """When the piston came to an end stop [s]."""
        return stop_visits(self.time, self.true, self.stroke)

    def beginning(self) -> Array:
        """The inputs as far as they show when a sensor that was started without a position knows where it is."""
        visits = self.visits
        return self.inputs[self.time <= visits[0] + _POWER_UP + SETTLED] if len(visits) else self.inputs


def tracked(several: Sequence[Run], sensors: Sequence[VirtualSensor], *, start_known: bool = True) -> list[Track]:
    """What sensors make of runs; a track is the same to the last bit whatever is tracked beside it.

    Args:
        sensors: of each run; they may assume different machines, but are of one kind.
        start_known: whether they start at the known position; of the others only so much is tracked that the
            time of the first position shows.
    """
    if not several:
        return []
    recursion = sensors[0].recursion
    says = recursion.outputs
    kept = [says[0], says[1], says[4], *([BOUND] if BOUND in says else [])]
    inputs = [run.inputs if start_known else run.beginning() for run in several]
    parameters = np.array([sensor.parameters for sensor in sensors])
    states = np.array([_first_state(sensor, run, start_known) for sensor, run in zip(sensors, several, strict=True)])
    found = replay_many(recursion, inputs, parameters, states, kept)
    return [_track(run, columns) for run, columns in zip(several, found, strict=True)]


def _first_state(sensor: VirtualSensor, run: Run, start_known: bool) -> Array:
    own = replace(sensor)  # with a state of its own: others may be tracked beside it
    own.start(run.start if start_known else None)
    return np.array(list(own.state.values()))


def _track(run: Run, columns: Array) -> Track:
    n = len(columns)
    position, std, status = columns[:, :3].T
    bound = columns[:, 3] if columns.shape[1] > 3 else None
    return Track(run.time[:n], position, std, status.astype(np.int64), run.true[:n], run.stroke, bound)
