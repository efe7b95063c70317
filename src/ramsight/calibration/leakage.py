"""The leak test: with the safety valve closed no oil reaches the cylinder, so the pump's flow is its leakage.

The motor turns slowly the lifting way, below the speed at which its pressure would open the check. Then D w = K dp,
and the torque gives dp: leakage is measured with no position reference at all. Such stretches are looked for in any
log; a slow lift looks the same in one stretch, but its pressure is the load's whatever the speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import RamsightError
from ramsight.plant.ddh import DdhUnit
from ramsight.sensor.balance import balance
from ramsight.sensor.chamber import Chamber

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

_SLOWEST = 1.0  # rad/s; below it friction is not fully developed
_STEADY = 0.25  # rad/s; what a steady speed may vary by, a little above the 1 rpm of a drive
_SPEED_STEP = math.pi / 30  # rad/s = 1 rpm, in which drives report speed; a steady speed is rounded all the time
_SETTLING = 5.0  # manifold time constants after which the pressure stands
_SHORTEST = 1.0  # s of settled samples
_LEAST_PRESSURE = 5e5  # Pa; below it no-load friction is most of the torque
_BELOW_LOAD = 0.9  # share of the load's pressure that a closed valve has to stay below
_WORST = 2.0  # leak factor that is still looked for; what turns faster is a lift
_OTHER_SPEED = 1.3  # how much faster a second speed has to be
_ALIKE = 0.08  # how far leak factors of different speeds may differ and still be leakage


class LeakTestError(RamsightError):
    """A log in which no leak test is to be found."""


@dataclass(frozen=True)
class Stretch:
    """A stretch of steady slow turning.

    Attributes:
        start, end: of its settled part [s].
        motor_speed: mean [rad/s].
        pressure: mean pressure above tank in the held manifold [Pa].
        oil_temperature: mean [K].
        factor: leakage over the data sheet's at this temperature [1].
        std: standard deviation of `factor` from the torque's scatter and the speed's rounding [1].
    """

    start: float
    end: float
    motor_speed: float
    pressure: float
    oil_temperature: float
    factor: float
    std: float


@dataclass(frozen=True)
class LeakTest:
    """What the leak tests of a log say.

    Attributes:
        factor: leakage over the data sheet's, corrected for viscosity [1].
        std: its standard deviation from the torque's scatter and the speed's rounding [1].
        per_kelvin: how much `factor` changes if the oil is 1 K warmer than the log says [1/K].
        per_torque: how much `factor` changes if the torque is 1 % larger than the log says [1].
        stretches: what it rests on.
    """

    factor: float
    std: float
    per_kelvin: float
    per_torque: float
    stretches: tuple[Stretch, ...]


def leak_test(unit: DdhUnit, log: xarray.Dataset) -> LeakTest:
    """Find leak tests in a drive log and evaluate them.

    Args:
        unit: the unit's parts, as its data sheet has them.
        log: Dataset over `time` with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K].

    Raises:
        LeakTestError: there is none, or slow turning that may as well be a slow lift.
    """
    found = _stretches(unit, log)
    if not found:
        raise LeakTestError(
            "no leak test in this log: it needs the motor to turn steadily in the lifting direction, slower than what "
            f"lifts the load, for {_SHORTEST:g} s and more"
        )
    load = _load_pressure(unit, log)
    closed = [s for s in found if load is not None and s.pressure < _BELOW_LOAD * load]
    if not closed:
        speeds = [abs(s.motor_speed) for s in found]
        low, high = (choose(found, key=lambda s: s.factor) for choose in (min, max))
        apart = high.factor - low.factor - 2.0 * (high.std + low.std)
        if max(speeds) < _OTHER_SPEED * min(speeds) or apart > _ALIKE * low.factor:
            raise LeakTestError(
                "slow turning found, but it may be a slow lift: repeat it at a second speed, or lift the load once in "
                "the same log"
            )
        closed = found
    weight = np.array([1.0 / s.std**2 for s in closed])
    factor = float(np.average([s.factor for s in closed], weights=weight))
    temperature = float(np.mean([s.oil_temperature for s in closed]))
    thinner = unit.oil.viscosity(temperature + 1.0) / unit.oil.viscosity(temperature)
    return LeakTest(
        factor=factor,
        std=float(1.0 / math.sqrt(weight.sum())),
        per_kelvin=factor * (float(thinner) - 1.0),
        per_torque=-0.01 * factor,
        stretches=tuple(closed),
    )


def _stretches(unit: DdhUnit, log: xarray.Dataset) -> list[Stretch]:
    held, other = Chamber.pair(unit)
    time, speed = log["time"].values, log["motor_speed"].values
    lifting = held.flow_sign * speed > _SLOWEST
    steady = lifting & (np.abs(speed - np.concatenate([speed[:1], speed[:-1]])) < _STEADY)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], steady, [False]]).astype(int)))
    result = []
    for first, last in zip(edges[::2], edges[1::2] - 1, strict=True):
        mean_temperature = float(np.mean(log["oil_temperature"].values[first : last + 1]))
        leak = float(held.side.pump.leak_coefficient(unit.oil.viscosity(mean_temperature), unit.oil.density))
        settled = time[first] + _SETTLING * float(held.manifold_capacity) / leak
        rows = slice(int(np.searchsorted(time, settled)), last + 1)
        if rows.stop - rows.start < 5 or time[last] - time[rows.start] < _SHORTEST or np.ptp(speed[rows]) > _STEADY:
            continue
        stretch = _evaluate(unit, held, other, log.isel(time=rows))
        if stretch is not None:
            result.append(stretch)
    return result


def _evaluate(unit: DdhUnit, held: Chamber, other: Chamber, part: xarray.Dataset) -> Stretch | None:
    """The leak factor of a settled stretch; the other side's manifold is at tank pressure, its check feeding it."""
    speed = float(part["motor_speed"].mean())
    torque = part["motor_torque"].values
    for side in (held, other):
        torque = torque - side.belt * side.side.pump.no_load_torque * float(side.direction(speed))
    pressure = torque / float(held.torque_per_pressure(float(held.direction(speed))))
    mean = float(pressure.mean())
    temperature = float(part["oil_temperature"].mean())
    leak = float(held.leak_per_pressure(mean, unit.oil.viscosity(temperature)))
    if mean < _LEAST_PRESSURE or float(held.delivered(speed)) > _WORST * leak * float(held.side.relief.setting):
        return None
    factor = float(held.delivered(speed)) / (leak * mean)
    scatter = float(pressure.std(ddof=1)) / math.sqrt(len(pressure))
    time = part["time"].values
    std = factor * math.hypot(scatter / mean, _SPEED_STEP / math.sqrt(12.0) / abs(speed))
    return Stretch(float(time[0]), float(time[-1]), speed, mean, temperature, factor, std)


def _load_pressure(unit: DdhUnit, log: xarray.Dataset) -> float | None:
    """Pressure of the load in the held chamber [Pa above tank] from the moves in the log; None if there are none.

    The smallest of all moves is taken: a closed valve has to stay below every load that was on it.
    """
    sensor = balance(unit)
    sensor.start(0.5 * unit.cylinder.stroke)
    load = sensor.track(log)["load"].values
    held, _ = Chamber.pair(unit)
    fast = np.abs(log["motor_speed"].values) * float(held.delivered(1.0) * held.flow_sign)
    temperature = float(log["oil_temperature"].mean())
    leak = float(held.side.pump.leak_coefficient(unit.oil.viscosity(temperature), unit.oil.density))
    moving = fast > _WORST * leak * float(held.side.relief.setting)
    if not np.any(moving):
        return None
    return float(np.percentile(load[moving], 5.0)) / float(held.area)


def leak_test_summary(test: LeakTest) -> str:
    """The leak factor with its uncertainty, and what it rests on, as lines of text."""
    lines = [
        f"leak factor {test.factor:.3f} ± {1.96 * test.std:.3f} "
        "(95 %, from the torque's scatter and the speed's rounding)",
        f"  {test.per_kelvin:+.3f} for each K that the oil is warmer than reported, "
        f"{test.per_torque:+.3f} for each % that the torque is larger",
    ]
    lines += [
        f"  {s.start:.1f} to {s.end:.1f} s: {s.motor_speed * 30 / math.pi:.0f} rpm hold "
        f"{s.pressure / 1e5:.1f} bar at {s.oil_temperature - 273.15:.1f} degC, factor {s.factor:.3f}"
        for s in test.stretches
    ]
    return "\n".join(lines)
