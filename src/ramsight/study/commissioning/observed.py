"""What a commissioning log says of a machine's values without its description: angles, torques, places.

Each observation is a logarithm with a standard deviation, and `predicted` gives what a unit would show in its place.
The travel from end to end needs no position sensor; with one, the travel of a turn and the stroke are known apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from statistics import median

import numpy as np

from ramsight.arrays import Array, Bools
from ramsight.calibration.leakage import LeakTest
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import Dataset
from ramsight.tracking.end_visits import visits
from ramsight.tracking.pressed import Pressed, Side, pressing_sides

RELIEF = {1: "relief torque extending", -1: "relief torque retracting"}
TRAVEL, LEAK, TURN, STROKE = "motor angle from end to end", "leak test", "travel of a turn", "stroke"
_LEVEL = 0.93  # of the highest plateau of a way, from which on a plateau is at the relief valve, too
_PRESS_STD = 0.02  # relative, of a plateau: override of the valve, friction of the pumps
_TRAVEL_STD = 0.008  # relative, of the angle from end to end: oil that is compressed, contacts that are seen late
_TURN_STD = 0.004  # relative, of the travel of a turn by a position sensor
_STROKE_STD = 0.003  # relative, of the stroke between stops by a position sensor
_MARGIN, _SPAN = 0.05, 0.1  # of the stroke: what is left out at either end; of a move that counts
_HELD = 0.5  # of the motor speed of a move, below which it is beginning or ending
_AT_RELIEF = 0.9  # of the torque at relief, beyond which oil goes over the valve


@dataclass(frozen=True)
class Observation:
    """One thing that a log says."""

    value: float  # natural logarithm of it, in SI
    std: float  # of that logarithm, from the log alone


def predicted(unit: HydraulicUnit) -> dict[str, float]:
    """What a unit would show: natural logarithms of the observations, in SI.

    Example:
        >>> import ramsight
        >>> round(math.exp(predicted(ramsight.build("mining-loader", "boom"))[STROKE]), 3)
        0.7
    """
    stops, per_radian, sides = unit.assumptions.stops, abs(unit.travel_per_radian), pressing_sides(unit)
    stroke = float(unit.cylinder.stroke) - stops.retracted - stops.extended
    found = {TRAVEL: math.log(stroke / per_radian), STROKE: math.log(stroke), TURN: math.log(per_radian)}
    found |= {RELIEF[way]: math.log(side.torque) for way, side in sides.items()}
    lifting = _lifting(unit, sides)
    if lifting is not None and lifting.leaking > 0.0:
        found[LEAK] = math.log(lifting.leaking / lifting.torque)
    return found


def observed(
    unit: HydraulicUnit, log: Dataset, track: Dataset, leak_test: LeakTest | None, truth: Dataset | None
) -> dict[str, Observation]:
    """What a log says of the machine; observations that it does not hold are left out.

    Args:
        unit: as described: where a stop is met, and how much leaks where there is no leak test.
        log: motor_speed [rad/s], motor_torque [N m], oil_temperature [K] over time [s], without gaps.
        truth: measured position [m] over time [s], if there is one.
    """
    sides = pressing_sides(unit)
    found = _relief_torques(unit, log, sides)
    lifting, leak = _lifting(unit, sides), 0.0
    if lifting is not None and lifting.leaking > 0.0:
        leak = lifting.leaking / lifting.torque * (1.0 if leak_test is None else leak_test.factor)
        if leak_test is not None:
            found[LEAK] = Observation(math.log(leak), leak_test.std / leak_test.factor)
    leaking = leak * _thinness(unit, log["oil_temperature"].values) * log["motor_torque"].values
    travel = _travel(log, track, leaking, unit.cylinder.stroke)
    if travel is not None:
        relative = unit.assumptions.machine.leak if leak_test is None else 0.1
        found[TRAVEL] = Observation(math.log(travel[0]), math.hypot(_TRAVEL_STD, relative * travel[1]))
    if truth is not None:
        found |= _measured(unit, log, truth, leaking, sides, LEAK in found)
    return found


def _lifting(unit: HydraulicUnit, sides: Mapping[int, Side]) -> Side | None:
    return sides.get(int(unit.lift_sign))


def _thinness(unit: HydraulicUnit, temperature: Array) -> Array:
    """How much thinner the oil is than at 40 degC [1]."""
    warm = np.clip(np.nan_to_num(temperature, nan=T40), *unit.oil.temperatures)
    kinds, which = np.unique(np.round(warm), return_inverse=True)  # whole kelvins
    thin = [float(unit.oil.viscosity(T40)) / float(unit.oil.viscosity(kelvin)) for kelvin in kinds]
    return np.asarray(np.array(thin)[which])


def _relief_torques(unit: HydraulicUnit, log: Dataset, sides: Mapping[int, Side]) -> dict[str, Observation]:
    """Torque of the highest plateaus of each way."""
    pressed = Pressed(unit)
    pressed.take(*(log[name].values for name in ("time", "motor_speed", "motor_torque", "oil_temperature")))
    found = {}
    for way, side in sides.items():
        levels = [press.level for press in pressed.presses if press.way == way]
        if levels:
            at = median(level for level in levels if level >= _LEVEL * max(levels))
            found[RELIEF[way]] = Observation(math.log(at * side.torque), _PRESS_STD)
    return found


def _travel(log: Dataset, track: Dataset, leaking: Array, stroke: float) -> tuple[float, float] | None:
    """Motor angle from one end to the other [rad], and what share of it leakage was; None without such a travel."""
    time, speed = log["time"].values, log["motor_speed"].values
    steps = np.diff(time, prepend=time[0])
    net, leaked = np.cumsum((speed - leaking) * steps), np.cumsum(np.abs(leaking) * steps)
    angles = []
    for a, b in pairwise(visits(track, stroke)):
        if a.way != b.way:
            first, last = np.searchsorted(time, [a.ends, b.begins])
            angle = abs(float(net[last] - net[first]))
            angles.append((angle, float(leaked[last] - leaked[first]) / max(angle, 1e-9)))
    usable = [one for one in angles if one[0] > 0.5 * max(angles)[0]]
    if not usable:
        return None
    return median(angle for angle, _ in usable), median(share for _, share in usable)


def _measured(
    unit: HydraulicUnit, log: Dataset, truth: Dataset, leaking: Array, sides: Mapping[int, Side], is_leak_known: bool
) -> dict[str, Observation]:
    """Travel of a turn and stroke by the measured position."""
    time, speed, torque = (log[name].values for name in ("time", "motor_speed", "motor_torque"))
    place = np.interp(time, truth["time"].values, truth["position"].values, left=np.nan, right=np.nan)
    low, high = float(np.nanmin(place)), float(np.nanmax(place))
    found = {}
    if high - low > 0.5 * unit.cylinder.stroke:
        found[STROKE] = Observation(math.log(high - low), _STROKE_STD)
    margin = _MARGIN * (high - low)
    free = (place > low + margin) & (place < high - margin)
    for way, side in sides.items():
        free &= (np.sign(speed) != way) | (way * torque < _AT_RELIEF * side.torque)
    steps = np.diff(time, prepend=time[0])
    angle, leaked = np.cumsum(speed * steps), np.cumsum(leaking * steps)
    rows = []
    for first, last in _steady_moves(speed, free):
        gone = float(place[last] - place[first])
        if abs(gone) > _SPAN * (high - low):
            rows.append((gone, float(angle[last] - angle[first]), -float(leaked[last] - leaked[first])))
    if len(rows) < 2:
        return found
    gone, turned, lost = np.array(rows).T
    if is_leak_known:
        per_turn = float((turned + lost) @ gone / ((turned + lost) @ (turned + lost)))
    else:
        per_turn = float(np.linalg.lstsq(np.column_stack([turned, lost]), gone, rcond=None)[0][0])
    if per_turn > 0.0:
        found[TURN] = Observation(math.log(per_turn), _TURN_STD)
    return found


def _steady_moves(speed: Array, free: Bools) -> list[tuple[int, int]]:
    """First and last sample of each stretch in which the motor turns steadily one way and the piston is free."""
    edges = np.flatnonzero(np.diff(np.sign(speed).astype(int), prepend=9, append=9))
    found = []
    for first, after in pairwise(edges):
        here = np.abs(speed[first:after])
        steady = np.flatnonzero((here > _HELD * here.max()) & free[first:after]) if here.max() > 0.0 else np.array([])
        if steady.size > 2:
            found.append((int(first + steady[0]), int(first + steady[-1])))
    return found
