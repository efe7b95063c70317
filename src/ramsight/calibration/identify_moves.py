"""Which samples of a record may be used: moves in which the chamber is joined to its pump, and what lies between.

Left out are the end stops, pressures near a relief valve's setting, and oil that is drawn from the tank; the balance is
not carried across them. Where a valve holds the load at rest the balance is carried across rests, and the load may
change there; where the pump holds it, what leaks at rest under a load that nobody sees is left out too.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ramsight.arrays import Array, Bools, Places, true_intervals
from ramsight.calibration.identify_record import Record, running_mean
from ramsight.calibration.identify_replay import Run
from ramsight.plant.holding import held_by_valve, holding_valves, opening_speed
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit, opposite

_MOVING = 0.025  # share of the velocity at the highest speed that a move has to reach
_SETTLE, _BEFORE_END = 0.2, 0.1  # s; after a move begins and before it ends, while the valve opens and closes
_RAMP_REACH, _RAMP_SHARE = 0.1, 0.03  # s; a speed that changes by this share between that before and that after
_AFTER_RAMP = 0.4  # s; until what the ramp has set in motion is at rest
_STEADY_SHARE = 0.3  # of the moves, from which the rest can be done without
_STOP = 3e-3  # share of the stroke; so near a stop the piston may touch it
_LEAKED = 3.0  # time constants after which what a stop has left has leaked off
_NEAR_RELIEF = 0.96  # share of the setting
_STARVED = 1e5  # Pa; with less on it a check valve may let oil in
_BLOCK = 0.5  # s; over which a node's values are averaged
_MOST_NODES = 300  # so many hold what a log of any length tells; matrices are as large
_STANDING = 0.06  # rad/s; half a step of 1 rpm
_ENOUGH_TRIPLES = 20  # of neighbouring nodes, so that a median means something
_GAP = 5.0  # sample periods; a longer distance between samples is a gap


@dataclass(frozen=True)
class Moves:
    """Nodes: blocks of samples in moves, in the order of time."""

    # first, last: of each node's samples, the last one excluded, shape (n,)
    first: Places
    last: Places
    run: Places  # number of the move, shape (n,)
    chain: Places  # nodes with the same number are joined by the balance, shape (n,)
    lifting: Bools  # whether the move lifts, shape (n,)
    held: bool  # whether the load stands while the motor does, so that nodes before and after a rest are joined

    def mean(self, values: Array) -> Array:
        """Mean of a column over each node."""
        total = np.concatenate([[0.0], np.cumsum(values)])
        return np.asarray((total[self.last] - total[self.first]) / (self.last - self.first))

    def samples(self) -> Places:
        """How many samples each node has."""
        return self.last - self.first

    def noise(self, values: Array) -> float:
        """Standard deviation of a column's white noise in the moves, from second differences."""
        inside = np.concatenate([np.arange(a, b - 2) for a, b in zip(self.first, self.last, strict=True)])
        return _white(np.diff(values, 2)[inside])

    def noise_of_mean(self, values: Array) -> Array:
        """Standard deviation of each node's mean of a column.

        Of white noise, or, where there are enough nodes to see it, of noise that lasts for some samples.
        """
        white = self.noise(values) / np.sqrt(self.samples())
        second = np.diff(self.mean(values), 2)[self.run[2:] == self.run[:-2]]
        return np.asarray(np.maximum(white, _white(second) if second.size >= _ENOUGH_TRIPLES else 0.0))


def _white(second: Array) -> float:
    """Standard deviation of white noise with these second differences; robust against a few large ones."""
    return float(np.sqrt(np.median(second**2) / (6.0 * 0.4549)))


def find_moves(unit: HydraulicUnit, record: Record, run: Run) -> Moves:
    """Find the moves of a record."""
    period = record.period
    direction = np.sign(run.velocity)
    settled = _shrunk(going(unit, record, run), direction, round(_SETTLE / period), round(_BEFORE_END / period))
    lost = _lost(unit, record, run, settled, direction)
    use = settled & ~lost
    steady = use & ~_ramping(record)
    use = steady if steady.sum() > _STEADY_SHARE * use.sum() else use
    breaks = np.cumsum(lost)
    length = max(round(_BLOCK / period), int(np.ceil(use.sum() / _MOST_NODES)))
    held = held_by_valve(unit)
    nodes: list[tuple[int, int, int, int]] = []
    number = -1
    for start, end in true_intervals(use):
        if end - start < max(length // 2, 3):
            continue
        number += 1
        cuts = np.linspace(start, end, max(1, (end - start) // length) + 1).astype(np.int64)
        chain = int(breaks[start]) if held else number
        nodes += [(int(a), int(b), number, chain) for a, b in pairwise(cuts)]
    first, last, runs, chains = np.array(nodes, dtype=np.int64).reshape(-1, 4).T
    return Moves(first, last, runs, chains, np.asarray(direction[first] > 0.0), held)


def going(unit: HydraulicUnit, record: Record, run: Run) -> Bools:
    """Samples at which the piston goes the way that the motor turns; arguments as `find_moves`."""
    lift_speed = unit.lift_sign * record.motor_speed
    fastest = float(unit.max_speed * unit.travel_per_radian)
    turning = (lift_speed > 0.0) | (lift_speed < -2.0 * opening_speed(unit))
    same = np.sign(run.velocity) == np.sign(lift_speed)
    return np.asarray(turning & same & (np.abs(run.velocity) > _MOVING * fastest))


def _lost(unit: HydraulicUnit, record: Record, run: Run, settled: Bools, direction: Array) -> Bools:
    """Samples across which nobody can say where the oil went."""
    stroke, period = unit.cylinder.stroke, record.period
    width = max(1, round(_SETTLE / period))
    touching = (record.position < _STOP * stroke) | (record.position > (1.0 - _STOP) * stroke)
    lost = _for_a_while(touching, round(_LEAKED * pressing_lasts(unit) / period))
    lost |= running_mean(run.near_relief, width) > _NEAR_RELIEF
    lost |= settled & (direction < 0.0) & (running_mean(run.suction, width) < _STARVED)
    lost |= record.step > _GAP * period
    if any(valve.opening_time is not None for valve in holding_valves(unit)):  # the pump turns against one until then
        below = unit.lift_sign * record.motor_speed < -0.5 * opening_speed(unit)
        lost |= np.diff(below.astype(int), prepend=0) > 0
    return np.asarray(lost, dtype=bool)


def _ramping(record: Record) -> Bools:
    """Samples at which the speed changes or has just changed.

    What oil and mass do then is over too soon for a noisy torque to tell, and is no leakage.
    """
    reach = max(1, round(_RAMP_REACH / record.period))
    speed = record.motor_speed
    padded = np.pad(speed, reach, mode="edge")
    change = np.abs(padded[2 * reach :] - padded[: -2 * reach])
    ramping = change > np.maximum(_RAMP_SHARE * np.abs(speed), 3.0 * record.speed_step)
    return _for_a_while(ramping, round(_AFTER_RAMP / record.period))


def _for_a_while(where: Bools, samples: int) -> Bools:
    """The samples, and so many after each."""
    since = np.arange(len(where)) - np.maximum.accumulate(np.where(where, np.arange(len(where)), -samples - 1))
    return np.asarray(since <= samples, dtype=bool)


def pressing_lasts(unit: HydraulicUnit) -> float:
    """Time constant with which the pumps leak off what a pressed stop has left in the chamber that holds no load [s].

    On a stop the circuit does not know how hard the piston presses, and so not how much oil is compressed.
    """
    cylinder, limits = unit.cylinder, limits_of(unit)
    side = opposite(unit.held)
    volume = cylinder.dead_volume(side) + cylinder.area(side) * cylinder.stroke
    leak = limits.leak_velocity * cylinder.area(unit.held) / limits.pressure
    return float(volume / unit.oil.bulk_modulus / leak)


def _shrunk(moving: Bools, direction: Array, front: int, back: int) -> Bools:
    """The moving samples without the first and last of each move."""
    result = np.zeros_like(moving)
    code = np.where(moving, direction, 0.0)
    edges = np.flatnonzero(np.diff(code, prepend=0.0, append=0.0))
    for start, end in pairwise(edges):
        if moving[start] and start + front < end - back:
            result[start + front : end - back] = True
    return result


def moved_at_rest(moves: Moves, record: Record, run: Run) -> Array:
    """How far the rod moved at rest before each node's move beyond what leaks [m]; NaN where the log cannot tell.

    A load that changes at rest presses the rod in or lets it out. Only the first node of a move may have a number.
    """
    moved = np.full(len(moves.run), np.nan)
    width = max(3, round(0.1 / record.period))
    for k in np.flatnonzero(np.diff(moves.run) > 0) + 1:
        if moves.chain[k] != moves.chain[k - 1]:
            continue
        between = slice(moves.last[k - 1], moves.first[k])
        standing = np.flatnonzero(np.abs(record.motor_speed[between]) < _STANDING) + moves.last[k - 1]
        settled = standing[2 * width :]  # after the valve has closed the piston comes to rest
        moved[k] = 0.0
        if settled.size >= 2 * width:
            moved[k] = abs(run.content[settled[-width:]].mean() - run.content[settled[:width]].mean())
    return moved
