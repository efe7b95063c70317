"""Which samples of a recorded log may be used: moves in which the chamber is joined to its pump, and what lies between.

Nothing is asked of the load: it may change at rest. Left out are the end stops, pressures near the relief valve's
setting, and a manifold that draws from the tank; the balance is not carried across them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ramsight.calibration.identify_hydraulics import MOVING, Balance, Hydraulics, running_mean

Array = NDArray[np.float64]
Places = NDArray[np.int64]

_SETTLE, _BEFORE_END = 0.2, 0.1  # s; after a move begins and before it ends, while the valve opens and closes
_STOP = 2e-3  # m; so near a stop the piston may touch it
_NEAR_RELIEF = 0.96  # share of the setting
_STARVED = 1e5  # Pa above tank; below it a lowering manifold may draw from the tank
_BLOCK = 0.5  # s; over which a node's values are averaged
_MOST_NODES = 1500
_STANDING = 0.06  # rad/s; half a step of 1 rpm
_GAP = 5.0  # sample periods; a longer distance between samples is a gap


@dataclass(frozen=True)
class Moves:
    """Nodes: blocks of samples in moves, in the order of time.

    Attributes:
        first, last: of each node's samples, the last one excluded, shape (n,).
        run: number of the move, shape (n,).
        chain: nodes with the same number are joined by the balance, shape (n,).
        moved: how far the rod moved at rest before the node's move [m], NaN where that is not known, shape (n,).
        lifting: whether the move lifts, shape (n,).
    """

    first: Places
    last: Places
    run: Places
    chain: Places
    moved: Array
    lifting: NDArray[np.bool_]

    def mean(self, values: Array) -> Array:
        """Mean of a column over each node."""
        total = np.concatenate([[0.0], np.cumsum(values)])
        return np.asarray((total[self.last] - total[self.first]) / (self.last - self.first))

    def samples(self) -> Places:
        """How many samples each node has."""
        return self.last - self.first


def find_moves(hydraulics: Hydraulics, balance: Balance) -> Moves:
    """Find the moves of a record.

    Args:
        hydraulics: of the record.
        balance: with the data sheet's values, for pressures near their limits.
    """
    unit, record = hydraulics.unit, hydraulics.record
    period = record.period
    lift_speed = unit.lift_sign * record.motor_speed
    opening = 2.0 * abs(unit.held_side.safety.opening_speed)
    turning = (lift_speed > 0.0) | (lift_speed < -opening)
    moving = turning & (np.abs(balance.velocity) > MOVING) & (np.sign(balance.velocity) == np.sign(lift_speed))
    pressure = running_mean(balance.pressure, max(1, round(0.2 / period)))
    lost = (hydraulics.travel < _STOP) | (hydraulics.travel > unit.cylinder.stroke - _STOP)
    lost |= pressure > _NEAR_RELIEF * hydraulics.held.relief.setting
    direction = np.sign(balance.velocity)
    settled = _shrunk(moving, direction, round(_SETTLE / period), round(_BEFORE_END / period))
    lost |= settled & (direction < 0.0) & (pressure < _STARVED)
    lost |= hydraulics.step > _GAP * period
    if unit.held_side.safety.opening_time is not None:  # the pump turns against the valve until it has opened
        lost |= np.diff((lift_speed < -0.5 * opening).astype(int), prepend=0) > 0
    use = settled & ~lost
    edges = np.flatnonzero(np.diff(np.concatenate([[False], use, [False]]).astype(int)))
    breaks = np.cumsum(lost)
    length = max(round(_BLOCK / period), int(np.ceil(use.sum() / _MOST_NODES)))
    first, last, run, chain = [], [], [], []
    number = -1
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start < max(length // 2, 3):
            continue
        number += 1
        cuts = np.linspace(start, end, max(1, (end - start) // length) + 1).astype(np.int64)
        first += cuts[:-1].tolist()
        last += cuts[1:].tolist()
        run += [number] * (len(cuts) - 1)
        chain += [int(breaks[start])] * (len(cuts) - 1)
    found = (np.array(values, dtype=np.int64) for values in (first, last, run, chain))
    starts, ends, runs, chains = found
    lifting = direction[starts] > 0.0 if len(starts) else np.zeros(0, dtype=bool)
    return Moves(starts, ends, runs, chains, _moved_at_rest(hydraulics, starts, ends, runs, chains), lifting)


def _shrunk(moving: NDArray[np.bool_], direction: Array, front: int, back: int) -> NDArray[np.bool_]:
    """The moving samples without the first and last of each move."""
    result = np.zeros_like(moving)
    code = np.where(moving, direction, 0.0)
    edges = np.flatnonzero(np.diff(code, prepend=0.0, append=0.0))
    for start, end in pairwise(edges):
        if moving[start] and start + front < end - back:
            result[start + front : end - back] = True
    return result


def _moved_at_rest(hydraulics: Hydraulics, first: Places, last: Places, run: Places, chain: Places) -> Array:
    """How far the rod moved at rest before each node's move [m]; NaN where the log cannot tell.

    A load that changes at rest presses the rod in or lets it out.
    """
    moved = np.full(len(run), np.nan)
    speed, position = hydraulics.record.motor_speed, hydraulics.record.position
    width = max(3, round(0.1 / hydraulics.record.period))
    for k in range(1, len(run)):
        if run[k] == run[k - 1] or chain[k] != chain[k - 1]:
            continue
        standing = np.flatnonzero(np.abs(speed[last[k - 1] : first[k]]) < _STANDING) + last[k - 1]
        settled = standing[2 * width :]  # after the valve has closed the piston comes to rest
        moved[k] = 0.0
        if settled.size >= 2 * width:
            moved[k] = abs(position[settled[-width:]].mean() - position[settled[:width]].mean())
    return moved
