"""The leak test: with the safety valve closed no oil reaches the cylinder, so the pump's flow is its leakage.

The motor turns slowly the lifting way, below the speed at which its pressure would open the check. Then D w = K dp,
and the torque gives dp: leakage is measured with no position reference at all. Such stretches are looked for in any
log; a slow lift looks the same in one stretch, but its pressure is the load's whatever the speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ramsight.arrays import true_intervals
from ramsight.calibration.loss_uncertainty import EFFICIENCY, NO_LOAD_TORQUE, dependence, rougher, with_friction_factor
from ramsight.errors import RamsightError
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.balance import balance as balance_of
from ramsight.plant.holding import held_by_valve, holding_valves
from ramsight.plant.hose import Volume
from ramsight.plant.limits import limits_of
from ramsight.plant.oil import Oil
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit, reach, side_nodes
from ramsight.sensor.balance import balance
from ramsight.signals import Samples, Signals
from ramsight.units import FREEZING, RPM

_SLOWEST = 1.0  # rad/s; below it friction is not fully developed
_STEADY = 0.25  # rad/s; what a steady speed may vary by, a little above the 1 rpm of a drive
_SPEED_STEP = RPM  # in which drives report speed; a steady speed is rounded all the time
_SETTLING = 5.0  # manifold time constants after which the pressure stands
_SHORTEST = 1.0  # s of settled samples
_LEAST_PRESSURE = 5e5  # Pa; below it no-load friction is most of the torque
_BELOW_LOAD = 0.9  # share of the load's pressure that a closed valve has to stay below
_WORST = 2.0  # leak factor that is still looked for; what turns faster is a lift
_OTHER_SPEED = 1.3  # how much faster a second speed has to be
_FACTORS = (0.2, 8.0)  # leak factors that a torque is looked for among
_HALVINGS = 30  # of that interval: a factor is found within 1e-8
_LONG, _SETTLED_STEPS = 20.0, 6  # s, steps; long against the settling of any manifold
_SLOPE = 0.01  # share of the torque over which a slope is taken
_ALIKE = 0.08  # how far leak factors of different speeds may differ and still be leakage


class LeakTestError(RamsightError):
    """A log in which no leak test is to be found."""


@dataclass(frozen=True)
class Stretch:
    """A stretch of steady slow turning."""

    # start, end: of its settled part [s]
    start: float
    end: float
    motor_speed: float  # mean [rad/s]
    pressure: float  # mean pressure above tank in the held manifold [Pa]
    oil_temperature: float  # mean [K]
    factor: float  # leakage over the data sheet's at this temperature [1]
    std: float  # standard deviation of `factor` from the torque's scatter and the speed's rounding [1]
    systematic: float  # what the pumps' described losses may put into it, the same in every stretch [1]
    per_torque: float  # how much `factor` changes if the torque is 1 % larger [1]


@dataclass(frozen=True)
class LeakTest:
    """What the leak tests of a log state."""

    factor: float  # leakage over the data sheet's, corrected for viscosity [1]
    # std: its standard deviation: the torque's scatter, the speed's rounding, and what the pumps' described losses
    # may be off: hydro-mechanical efficiency anywhere within 0.02, no-load torque by a quarter [1]
    std: float
    per_kelvin: float  # how much `factor` changes if the oil is 1 K warmer than the log states [1/K]
    per_torque: float  # how much `factor` changes if the torque is 1 % larger than the log states [1]
    stretches: tuple[Stretch, ...]  # what it rests on


def leak_test(unit: HydraulicUnit, log: Samples) -> LeakTest:
    """Find leak tests in a drive log and evaluate them.

    Args:
        unit: the unit's parts, as its data sheet has them.
        log: over `time` [s], with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K].

    Raises:
        LeakTestError: there is none, or slow turning that may as well be a slow lift.
    """
    log = Signals.of(log)
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

    def mean(values: list[float]) -> float:
        return float(np.average(values, weights=weight))

    factor = mean([s.factor for s in closed])
    temperature = float(np.mean([s.oil_temperature for s in closed]))
    return LeakTest(
        factor=factor,
        std=math.hypot(1.0 / math.sqrt(weight.sum()), mean([s.systematic for s in closed])),
        per_kelvin=factor * per_kelvin(unit.oil, temperature),
        per_torque=mean([s.per_torque for s in closed]),
        stretches=tuple(closed),
    )


def per_kelvin(oil: Oil, temperature: float) -> float:
    """Share of a leak factor that it becomes larger by if the oil is 1 K warmer than reported [1/K].

    Leakage through gaps is in inverse proportion to the viscosity (eq. 10).

    Args:
        temperature: as reported [K].
    """
    return float(oil.viscosity(temperature + 1.0) / oil.viscosity(temperature)) - 1.0


def _stretches(unit: HydraulicUnit, log: Signals) -> list[Stretch]:
    closed = ClosedPump(unit)
    time, speed = log["time"].values, log["motor_speed"].values
    lifting = unit.lift_sign * speed > _SLOWEST
    steady = lifting & (np.abs(speed - np.concatenate([speed[:1], speed[:-1]])) < _STEADY)
    result = []
    for first, end in true_intervals(steady):
        last = end - 1
        settled = time[first] + _SETTLING * closed.settles(float(speed[first]))
        rows = slice(int(np.searchsorted(time, settled)), last + 1)
        if rows.stop - rows.start < 5 or time[last] - time[rows.start] < _SHORTEST or np.ptp(speed[rows]) > _STEADY:
            continue
        stretch = _evaluate(closed, log.rows(rows))
        if stretch is not None:
            result.append(stretch)
    return result


class ClosedPump:
    """The torque of a unit whose piston does not move: all that its pumps deliver is leakage."""

    def __init__(self, unit: HydraulicUnit) -> None:
        self.unit, self.limits, self._balance = unit, limits_of(unit), balance_of(with_friction_factor(unit))
        speed, temperature, leak = (ca.SX.sym(name) for name in ("speed", "temperature", "leak"))
        p = ca.SX.sym("p", len(self._balance.parameters))
        at = self._balance.parameters_at(p, temperature)
        # The load keeps a check valve shut; where there is none the chamber has the pump's pressure in the end.
        z: Any = ca.DM(self._balance.at_rest(0.5 * unit.cylinder.stroke, 0.95 * self.limits.load))
        for _ in range(_SETTLED_STEPS):
            done = self._balance.step(
                z, speed, speed, 0.0, 0.0, at, _LONG, factors=(leak, 1.0, 1.0), held=1.0, iterations=4, settles=True
            )
            z = done.z
        self._torque = ca.Function("torque", [leak, speed, temperature, p], [done.torque])

    def torque(self, leak: float, speed: float, temperature: float, **changed: float) -> float:
        """Torque in the end [N m].

        Args:
            leak: factor on the leakage [1].
            speed: of the motor [rad/s].
            temperature: of the oil [K].
            changed: factors on parameters whose names end so, for example ``no_load_torque=1.2``.
        """
        names, values = self._balance.parameters, self._balance.values.copy()
        for k, name in enumerate(names):
            values[k] *= changed.get(name.rsplit(".", 1)[-1], 1.0)
        return float(self._torque(leak, speed, temperature, values))

    def factor(self, torque: float, speed: float, temperature: float, **changed: float) -> float | None:
        """The leak factor that explains a torque; None if none within reason does. Arguments as `torque`."""
        low, high = _FACTORS
        if not self._between(torque, low, high, speed, temperature, changed):
            return None
        for _ in range(_HALVINGS):
            middle = math.sqrt(low * high)
            if self._between(torque, low, middle, speed, temperature, changed):
                high = middle
            else:
                low = middle
        return math.sqrt(low * high)

    def _between(
        self, torque: float, low: float, high: float, speed: float, temperature: float, changed: dict[str, float]
    ) -> bool:
        less, more = (abs(self.torque(leak, speed, temperature, **changed)) for leak in (high, low))
        return less <= abs(torque) <= more

    def described_losses(self) -> tuple[dict[str, float], ...]:
        """By how much the pumps' losses may be off, a standard deviation each: factors for `torque`."""
        pumps = [part for part in self.unit.parts() if isinstance(part, Pump)]
        nominal = float(np.mean([pump.hydromechanical_efficiency for pump in pumps]))
        less = {"hydromechanical_efficiency": 1.0 - EFFICIENCY / nominal}
        if any(pump.table is not None for pump in pumps):
            less["friction_factor"] = rougher(nominal, -EFFICIENCY)
        return less, {"no_load_torque": 1.0 + NO_LOAD_TORQUE}

    def pressure(self, torque: float) -> float:
        """Pressure on the held side that a torque stands for, losses left out [Pa]."""
        return abs(torque) / self.limits.torque * self.limits.pressure

    def settles(self, speed: float) -> float:
        """Time constant with which the pressure settles [s]: the compressed oil over the leakage.

        Where the pump holds the load the piston stands on its upper stop, and its chamber is compressed too.
        """
        unit, nodes = self.unit, reach(self.unit.parts(), self._pumped(), "joins")
        volume = sum(p.volume for p in unit.parts() if isinstance(p, Volume) and p.node in nodes)
        if not (holding_valves(unit) or held_by_valve(unit)):
            cylinder = unit.cylinder
            volume += cylinder.dead_volume(unit.held) + cylinder.area(unit.held) * cylinder.stroke
        leak = self.limits.leak_velocity * float(unit.cylinder.area(unit.held)) / self.limits.pressure
        return float(volume) / unit.oil.bulk_modulus / leak

    def _pumped(self) -> str:
        into = "outlet" if self.unit.lift_sign > 0.0 else "inlet"
        sides = side_nodes(self.unit, self.unit.held)
        pumps = [part for part in self.unit.parts() if isinstance(part, Pump)]
        return next((str(getattr(p, into)) for p in pumps if getattr(p, into) in sides), str(getattr(pumps[0], into)))


def _evaluate(closed: ClosedPump, part: Signals) -> Stretch | None:
    """The leak factor of a settled stretch."""
    speed, torque = float(part["motor_speed"].values.mean()), part["motor_torque"].values
    temperature, mean = float(part["oil_temperature"].values.mean()), float(torque.mean())
    factor = closed.factor(mean, speed, temperature)
    fast = abs(speed) * float(closed.unit.travel_per_radian) > _WORST * closed.limits.leak_velocity
    if closed.pressure(mean) < _LEAST_PRESSURE or factor is None or fast:
        return None
    scatter = float(torque.std(ddof=1)) / math.sqrt(len(torque))
    more = closed.factor(mean * (1.0 + _SLOPE), speed, temperature)
    slope = (factor if more is None else more) - factor
    by_torque = abs(slope) * scatter / (_SLOPE * abs(mean))
    by_speed = factor * _SPEED_STEP / math.sqrt(12.0) / abs(speed)
    systematic = [(closed.factor(mean, speed, temperature, **c) or factor) - factor for c in closed.described_losses()]
    time = part["time"].values
    return Stretch(
        float(time[0]),
        float(time[-1]),
        speed,
        closed.pressure(mean),
        temperature,
        factor,
        math.hypot(by_torque, by_speed),
        math.hypot(*systematic),
        slope / _SLOPE / 100.0,
    )


def _load_pressure(unit: HydraulicUnit, log: Signals) -> float | None:
    """Pressure of the load in the held chamber [Pa above tank] from the moves in the log; None if there are none.

    The smallest of all moves is taken: a closed valve has to stay below every load that was on it.
    """
    sensor, limits = balance(unit), limits_of(unit)
    sensor.start(0.5 * unit.cylinder.stroke)
    load = sensor.followed(log)["load"].values
    fast = np.abs(log["motor_speed"].values) * float(unit.travel_per_radian)
    moving = fast > _WORST * limits.leak_velocity
    if not np.any(moving):
        return None
    return float(np.percentile(load[moving], 5.0)) / float(unit.cylinder.area(unit.held))


def leak_test_summary(test: LeakTest) -> str:
    """The leak factor with its uncertainty, and what it rests on, as lines of text."""
    lines = [
        f"leak factor {test.factor:.3f} ± {TWO_SIDED_95 * test.std:.3f} "
        "(95 %: scatter of the torque, rounding of the speed, and the pumps' described losses)",
        f"  {dependence(test.per_kelvin, test.per_torque)}",
    ]
    lines += [
        f"  {s.start:.1f} to {s.end:.1f} s: {s.motor_speed / RPM:.0f} rpm hold "
        f"{s.pressure / 1e5:.1f} bar at {s.oil_temperature - FREEZING:.1f} degC, factor {s.factor:.3f}"
        for s in test.stretches
    ]
    return "\n".join(lines)
