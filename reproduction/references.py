"""What tells a position for certain: proximity switches on the simulated machine, and the end stop in the torque.

Either becomes the `reference` of a drive log: a position [m] at the samples that know one, NaN elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

_TURNING = 10.0  # rad/s; slower than this a motor is about to stop or to start, and its torque says little
_LEVEL_AFTER, _LEVEL_FOR = 0.2, 0.4  # s; when and how long the torque of a lowering move is learnt
_COLLAPSED, _CERTAIN = 0.4, 3  # share of that torque below which the rod stands on its stop, samples in a row


@dataclass(frozen=True)
class ProximitySwitch:
    """A proximity switch on the cylinder: it closes when the rod comes below a position, opens above it.

    Args:
        position: where it closes [m].
        hysteresis: how much farther the rod has to go for it to open [m].
        response_time: from the rod's passing to the switch's output [s].

    Example:
        >>> switch = ProximitySwitch(0.1, hysteresis=1e-3, response_time=2e-3)
        >>> round(1e3 * switch.accuracy(velocity=0.02, sample_period=0.02), 2)
        0.94
    """

    position: float
    hysteresis: float = 1e-3
    response_time: float = 5e-3

    def accuracy(self, velocity: float, sample_period: float) -> float:
        """Largest error of its report [m] with a rod of this velocity [m/s] and a log of this period [s]."""
        return 0.5 * self.hysteresis + abs(velocity) * (self.response_time + sample_period)

    def edges(self, time: Array, position: Array) -> Array:
        """Times at which its output changes [s].

        Args:
            time: [s], shape (n,), increasing.
            position: of the rod [m], shape (n,).
        """
        closed = bool(position[0] < self.position)
        found = []
        opens, closes = (_crossings(time, position, at) for at in (self.position + self.hysteresis, self.position))
        for when, rising in sorted([*((t, up) for t, up in opens if up), *((t, up) for t, up in closes if not up)]):
            if rising == closed:  # a rising crossing opens a closed switch, a falling one closes an open one
                closed = not closed
                found.append(when + self.response_time)
        return np.array(found)

    @property
    def reported(self) -> float:
        """The position that an edge stands for [m]: in the middle of the hysteresis."""
        return self.position + 0.5 * self.hysteresis


def with_switches(log: xarray.Dataset, run: xarray.Dataset, switches: Sequence[ProximitySwitch]) -> xarray.Dataset:
    """A drive log with the reports of switches as its `reference`.

    Args:
        log: what the drive reported of the run.
        run: the simulated run; its position moves the switches, and goes no further.
        switches: on the cylinder.
    """
    time = log["time"].values
    reference = np.full(len(time), math.nan)
    for switch in switches:
        seen = np.searchsorted(time, switch.edges(run["time"].values, run["position"].values))
        reference[seen[seen < len(time)]] = switch.reported
    return _with_reference(log, reference)


def with_stop(log: xarray.Dataset, lift_sign: float, lowered_end: float) -> xarray.Dataset:
    """A drive log with the lowered end stop, seen in the torque alone, as its `reference`.

    While the unit lowers, the load's torque is learnt; once it collapses the rod stands on its stop and the oil under
    it is gone. From then until the motor stops the position is the stop's.

    Args:
        log: what the drive reported.
        lift_sign: +1 if positive motor speed lifts, else -1.
        lowered_end: position of that stop [m].
    """
    time, speed = log["time"].values, lift_sign * log["motor_speed"].values
    torque = lift_sign * log["motor_torque"].values
    reference = np.full(len(time), math.nan)
    lowering = np.concatenate([[False], speed < -_TURNING, [False]])
    edges = np.flatnonzero(np.diff(lowering.astype(int)))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        inside = time[first:last] - time[first]
        learning = (inside > _LEVEL_AFTER) & (inside < _LEVEL_AFTER + _LEVEL_FOR)
        if not learning.any():
            continue
        low = (torque[first:last] < _COLLAPSED * np.median(torque[first:last][learning])) & (
            inside > _LEVEL_AFTER + _LEVEL_FOR
        )
        certain = np.convolve(low, np.ones(_CERTAIN), "full")[: len(low)] >= _CERTAIN
        if certain.any():
            reference[first + int(np.argmax(certain)) : last] = lowered_end
    return _with_reference(log, reference)


def _with_reference(log: xarray.Dataset, reference: Array) -> xarray.Dataset:
    attributes = {"units": "m", "long_name": "position that a reference switch reports, NaN elsewhere"}
    return log.assign(reference=("time", reference, attributes))


def _crossings(time: Array, position: Array, at: float) -> list[tuple[float, bool]]:
    """When the position crosses a value, and whether it rises."""
    above = position >= at
    k = np.flatnonzero(above[1:] != above[:-1])
    share = (at - position[k]) / (position[k + 1] - position[k])
    times = time[k] + share * (time[k + 1] - time[k])
    return list(zip(times.tolist(), above[k + 1].tolist(), strict=True))
