"""The true position of a log, and what of it a piston can have: a sensor that wraps, jumps or freezes is no truth.

A position counts within the stroke, and where it is reached no faster than the piston can go. A stretch without change
counts for frozen if the pump delivers into the cylinder meanwhile and the torque does not rise to that of the relief
valve: oil that is pressed against a piston which stands would open it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ramsight.arrays import Array, Bools, true_intervals
from ramsight.constant import Constant
from ramsight.errors import LogError, warn_of_log
from ramsight.logs.channel_map import known_map
from ramsight.logs.channels import POSITION, is_command
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.opening import measured_signals
from ramsight.logs.truth import truth_signals
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.thresholds import PRESSURE_ABOVE, PRESSURE_BELOW
from ramsight.signals import TIME, Dataset, Samples, Signals
from ramsight.tracking.track_errors import ComparisonError

OUTSIDE = Constant(0.05, "1", "of the stroke, by which a position may lie outside it: a sensor's zero is never exact")
_FASTER = Constant(3.0, "1", "times the pump's fastest piston: a load that runs ahead, while valves let it")
_SPAN = Constant(0.1, "s", "over which a velocity is judged: five samples of a usual drive, and no glitch is as long")
_STEP = Constant(0.01, "1", "of the stroke, by which readings may step: coarse sensors, rods that spring")
_DELIVERED = Constant(0.1, "1", "of the stroke, that the pump has to deliver before a position counts for frozen")
_PRESSED = Constant(0.7, "1", "of the torque at relief pressure, that a piston which is held would have reached")
_HELD = Constant(0.5, "s", "over which a pressure's mean is judged; noise and spikes are shorter")


_NOT_THERE = "is where this piston cannot be"


@dataclass(frozen=True)
class Stretch:
    """Samples in a row that are not credible."""

    # begins, ends: when [s]
    begins: float
    ends: float
    why: str

    def __str__(self) -> str:
        return f"from {self.begins:.2f} to {self.ends:.2f} s {self.why}"


def credible_truth(truth: Signals, unit: HydraulicUnit, file: str) -> Signals:
    """A measured position without the samples that no piston of the unit can have; warns of them.

    Args:
        truth: `position` [m] over `time` [s].
    """
    time, position = truth["time"].values, truth["position"].values
    good = possible_positions(time, position, unit)
    # What hardly moves before its first fault is no measurement, but in another unit.
    moved = np.ptp(position[good]) if good.any() else 0.0
    if good.all() or moved < OUTSIDE * float(unit.cylinder.stroke):
        return truth
    if said := _stretches(time, ~good & np.isfinite(position), _NOT_THERE):
        _warn(file, "position", said)
    return truth.rows(good)


def credible_run(log: Dataset, measured: Dataset, unit: HydraulicUnit, file: str) -> Dataset:
    """What was measured along a log, NaN where it is not credible; warns of it.

    Args:
        log: of the drive, over `time` [s].
        measured: `position` [m] and maybe `pressure_a`, `pressure_b` [Pa] over the same time.
    """
    time, position = log["time"].values, measured["position"].values
    bad = {"position": ~possible_positions(time, position, unit) & np.isfinite(position)}
    still = said_frozen(log, np.where(bad["position"], np.nan, position), unit, file)
    found = {"position": _NOT_THERE}
    position = np.where(still, np.nan, position)
    for name in ("pressure_a", "pressure_b"):
        if name in measured:
            bad[name] = ~possible_pressures(time, measured[name].values, unit)
            found[name] = "is below vacuum, or beyond what the relief valves let it be"
    result = measured.assign(position=("time", position))
    for name, where in bad.items():
        if where.any():
            _warn(file, name, _stretches(time, where, found[name]))
            result = result.assign({name: ("time", np.where(where, np.nan, result[name].values))})
    return result


def said_frozen(log: Dataset, position: Array, unit: HydraulicUnit, file: str) -> Bools:
    """Where `frozen_positions` finds one; a warning names the file."""
    still = frozen_positions(log, position, unit)
    if still.any():
        why = "stands while the pump delivers, and nothing holds the piston"
        _warn(file, "position", _stretches(log["time"].values, still, why))
    return still


def possible_positions(time: Array, position: Array, unit: HydraulicUnit) -> Bools:
    """Whether the piston can have each position: within the stroke, and reached no faster than it goes.

    Without a jump every position counts: one that lies outside the stroke then has another zero, or another unit. The
    longest stretch without a fault counts, and those beside it as far as the piston can come from there.

    Args:
        time: [s], increasing.
        position: [m]; not-a-number is not possible.
    """
    stroke = float(unit.cylinder.stroke)
    fastest, step, margin = _fastest(unit), _STEP * stroke, OUTSIDE * stroke
    known = np.flatnonzero(np.isfinite(position))
    good = np.isfinite(position)
    before = known[np.searchsorted(time[known], time[known] - _SPAN)]
    too_fast = np.abs(position[known] - position[before]) > fastest * (time[known] - time[before]) + step
    if not too_fast.any():
        return good
    good[known[too_fast]] = False
    good &= ~((position < -margin) | (position > stroke + margin))
    parts = true_intervals(good)
    if not parts:
        return good
    first = max(range(len(parts)), key=lambda k: parts[k][1] - parts[k][0])
    kept = np.zeros(len(good), dtype=bool)
    for ways in (range(first, len(parts)), range(first, -1, -1)):
        edge: tuple[float, float] | None = None
        for k in ways:
            a, b = parts[k]
            near, far = (a, b - 1) if ways.step > 0 else (b - 1, a)
            if edge is not None and abs(position[near] - edge[1]) > fastest * abs(time[near] - edge[0]) + step:
                continue
            kept[a:b] = True
            edge = float(time[far]), float(position[far])
    return kept


def frozen_positions(log: Dataset, position: Array, unit: HydraulicUnit) -> Bools:
    """Whether the position stands though the pump moves the piston: oil is delivered, and no pressure comes of it.

    Args:
        log: motor_speed [rad/s] and motor_torque [N m] over `time` [s].
        position: [m], over the same time.
    """
    time, limits = log["time"].values, limits_of(unit)
    one_way = any(is_command(str(name)) for name in log.data_vars)
    lifting = log["motor_speed"].values * (1.0 if one_way else float(unit.lift_sign))
    travel = np.clip(np.nan_to_num(lifting), 0.0, None) * abs(unit.travel_per_radian) - limits.leak_velocity
    delivered = np.concatenate([[0.0], np.cumsum(np.clip(travel[1:], 0.0, None) * np.clip(np.diff(time), 0.0, None))])
    torque = np.abs(np.nan_to_num(log["motor_torque"].values))
    frozen = np.zeros(len(time), dtype=bool)
    same = np.concatenate([np.diff(position) == 0.0, [False]])
    for a, b in true_intervals(same):
        moved = delivered[b] - delivered[a] > _DELIVERED * float(unit.cylinder.stroke)
        if moved and np.quantile(torque[a : b + 1], 0.99) < _PRESSED * limits.torque:
            frozen[a : b + 1] = True
    return frozen


def possible_pressures(time: Array, pressure: Array, unit: HydraulicUnit) -> Bools:
    """Whether a pressure can be one of the unit's: its mean over half a second above vacuum and below relief.

    Args:
        time: [s].
        pressure: absolute [Pa].
    """
    highest = limits_of(unit).pressure
    period = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    width = max(1, min(round(_HELD / max(period, 1e-6)), len(time)))
    mean = np.convolve(np.nan_to_num(pressure), np.ones(width) / width, "same")
    ends = np.convolve(np.ones(len(time)), np.ones(width) / width, "same")
    mean = mean / ends
    return np.asarray((mean > -PRESSURE_BELOW * highest) & (mean < (1.0 + PRESSURE_ABOVE) * highest))


def _fastest(unit: HydraulicUnit) -> float:
    """The fastest that a piston goes [m/s]: by its pump on the smaller area, with a load that runs ahead."""
    cylinder = unit.cylinder
    areas = float(cylinder.area_a), float(cylinder.area_b)
    return _FASTER * float(unit.max_speed) * abs(float(unit.travel_per_radian)) * max(areas) / min(areas)


def _stretches(time: Array, bad: Bools, why: str) -> list[Stretch]:
    return [Stretch(float(time[a]), float(time[b - 1]), why) for a, b in true_intervals(bad)]


def _warn(file: str, column: str, stretches: list[Stretch]) -> None:
    longest = max(stretches, key=lambda one: one.ends - one.begins)
    more = f" (and in {len(stretches) - 1} shorter stretches)" if len(stretches) > 1 else ""
    warn_of_log(f"{longest}{more}: left out", file=file, column=column)


_FARTHEST = 3.0  # strokes; no measured position of a piston is farther from its retracted end


def known_position(
    truth: str | Path | Dataset | None, log: object, channel_map: ChannelMap | str | Path | None, unit: HydraulicUnit
) -> Signals | None:
    """The true position of a log: as it is passed, of a file, or of the log itself.

    Args:
        truth: a file, or `position` [m] over `time` [s]; None: what the log holds itself, if its map names it.

    Returns:
        `position` [m] over `time` [s], without samples where this piston cannot be, which a warning names; None if
        there is none.

    Raises:
        LogError: a file cannot be read, or has no number there.
        ComparisonError: no piston of this stroke can have that position.
    """
    if truth is None:
        known = truth_in(log, channel_map)
    else:
        known = truth_signals(truth) if isinstance(truth, str | Path) else Signals.of(truth)
    if known is None:
        return None
    source = next((str(one) for one in (truth, log) if isinstance(one, str | Path)), "true position")
    left = credible_truth(known, unit, source)
    possible_truth(left, float(unit.cylinder.stroke))
    return left


def truth_in(log: object, channel_map: ChannelMap | str | Path | None) -> Signals | None:
    """The true position that a log holds itself, where its map names one under `measured`.

    Returns:
        `position` [m] over the log's `time` [s], where there is a number; None if the map names none.

    Raises:
        LogError: the log cannot be read, or has no number there.
    """
    known = known_map(channel_map)
    if not isinstance(log, str | Path) or known is None or POSITION.name not in known.measured:
        return None
    measured = measured_signals(log, known)
    columns = {name: measured[name] for name in (TIME, POSITION.name)}
    found = Signals(columns).rows(np.isfinite(measured[POSITION.name].values))
    if not len(found):
        raise LogError(f"has no number of {known.measured[POSITION.name].channel}", file=str(log))
    return found


def possible_truth(truth: Samples, stroke: float) -> None:
    """Reject a true position that no piston of this stroke can have; it is most often in another unit.

    Args:
        truth: `position` [m].
        stroke: of the cylinder [m].

    Raises:
        ComparisonError: it goes farther than three strokes.
    """
    farthest = float(np.nanmax(np.abs(truth["position"].values), initial=0.0))
    if farthest > _FARTHEST * stroke:
        hint = ": is it in mm?" if farthest * 1e-3 <= _FARTHEST * stroke else ""
        raise ComparisonError(f"the true position reaches {farthest:.5g} m, the stroke is {stroke:g} m{hint}")
