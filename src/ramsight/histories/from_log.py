"""A log followed by a new sensor, as a record: every log begins with what the description says, and nothing else."""

from __future__ import annotations

import copy
import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ramsight.arrays import Array, true_intervals
from ramsight.calibration.sensors import sensor_for
from ramsight.errors import LogError
from ramsight.histories.record import Learned, Record, begun
from ramsight.logs.channel_map import AnyMap
from ramsight.logs.opening import open_signals
from ramsight.plant.oil import Oil
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kind import KINDS, covariance_of, state_of
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.status import is_invalid
from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.signals import Signals
from ramsight.tracking.availability import PassedTime
from ramsight.tracking.named_faults import FaultNames
from ramsight.tracking.pressed import TURNING, Pressed
from ramsight.tracking.watched import Watch

SENSED = {
    "leak": Quantity.LEAKAGE,
    "displacement": Quantity.DISPLACEMENT,
    "compliance": Quantity.COMPLIANCE,
    "exponent": Quantity.EXPONENT,
}
"""What the sensor learns, by its name in a history."""
_COLUMNS = ("time", "motor_speed", "motor_torque", "oil_temperature")
_LEVEL = 0.93  # of the highest plateau of a way, from which on a plateau is at the relief valve, too
_PRESS_STD = 0.02  # relative, of a plateau: override of the valve, friction of the pumps
_BLOCK = 1 << 20
_KELVINS = 2.0  # between which the viscosity is looked at


def file_digest(path: Path) -> str:
    """SHA-256 of a file's bytes.

    Raises:
        LogError: it cannot be read.
    """
    found = hashlib.sha256()
    try:
        with path.open("rb") as file:
            while block := file.read(_BLOCK):
                found.update(block)
    except OSError as error:
        raise LogError(error.strerror or str(error), file=str(path)) from None
    return found.hexdigest()


class Following:
    """What makes records of a unit's logs."""

    def __init__(self, unit: HydraulicUnit, channel_map: AnyMap | None = None) -> None:
        self.unit, self.channel_map = unit, channel_map
        self._sensor = sensor_for(unit, "kalman")

    def record(
        self, path: Path, at: float | None = None, digest: str = "", advance: Callable[[float], object] | None = None
    ) -> Record:
        """The record of a log.

        Args:
            at: when it begins [s since 1970]; None: as its clock, its name or its file says.

        Raises:
            LogError: it cannot be read, or has no samples.
        """
        sensor = copy.copy(self._sensor)
        sensor.start(None)
        seen = Counted(self.unit)
        watch = Watch(self.unit, path, self.channel_map)
        for piece in watch.over(open_signals(path, self.channel_map, advance=advance)):
            seen.take(piece, sensor.followed(piece))
        if seen.samples == 0:
            raise LogError("has no samples", file=str(path))
        found = record_of(self.unit, sensor, seen, path.name, begun(path, seen.first, at), digest or file_digest(path))
        return found if watch.mistake is None else replace(found, mistake=watch.last_word)


def record_of(
    unit: HydraulicUnit, sensor: VirtualSensor, seen: Counted, name: str, when: tuple[float, str], digest: str = ""
) -> Record:
    """The record of what a new sensor has followed.

    Args:
        seen: what was counted of it, one sample at least.
        when: it begins [s since 1970], and what says so.
        digest: of the file; empty for that of the samples.
    """
    quantities, covariances = learned(sensor)
    relief = relief_level(seen.pressed)
    if relief is not None:
        quantities["relief"] = relief
    state = sensor.state
    low, mean, high = seen.oil
    per_kelvin, per_kelvin2 = thinning(unit.oil, mean)
    samples = seen.digest.hexdigest()
    return Record(
        log_digest=samples,
        file_digest=digest or samples,
        file=name,
        begun=when[0],
        dated_by=when[1],
        duration=seen.passed.seconds,
        worked=seen.worked,
        oil_low=low,
        oil_high=high,
        oil_mean=mean,
        leak_per_kelvin=per_kelvin,
        leak_per_kelvin2=per_kelvin2,
        references=round(state["met_low"] + state["met_top"]) + seen.switched,
        available=seen.usable / seen.samples,
        consistency=1.0 + state["innovations"],
        faults=tuple(one.text for one in seen.faults.close()),
        quantities=quantities,
        covariances=covariances,
    )


def learned(sensor: VirtualSensor) -> tuple[dict[str, Learned], dict[str, float]]:
    """What a sensor has learned, under its likeliest hypothesis, with the prior of that one; and the covariances.

    Args:
        sensor: of the kind ``kalman``, after a log.
    """
    state, before = sensor.state, dict(zip(sensor.recursion.state, sensor.initial.tolist(), strict=True))
    places = range(len([kind for kind in KINDS if f"hypotheses[{int(kind)}].log_weight" in state]))
    k = max(places, key=lambda place: state[f"hypotheses[{place}].log_weight"])
    quantities, covariances = {}, {}
    for name, quantity in SENSED.items():
        at, variance = state_of(k, quantity), covariance_of(k, quantity, quantity)
        found, prior = state[variance], before[variance]
        quantities[name] = Learned(
            state[at], math.sqrt(max(found, 0.0)), _prior(quantity), math.sqrt(prior) if prior > 0.0 else math.inf
        )
    names = list(SENSED)
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            first, second = sorted((SENSED[one], SENSED[other]), key=list(Quantity).index)
            covariances[f"{one} {other}"] = state[covariance_of(k, first, second)]
    return quantities, covariances


def _prior(quantity: Quantity) -> float:
    """What a description says of a quantity that a sensor learns."""
    return 0.0 if quantity is Quantity.EXPONENT else 1.0


def thinning(oil: Oil, temperature: float) -> tuple[float, float]:
    """Derivatives of the logarithm of a leak factor by how much warmer the oil is than reported [1/K, 1/K^2].

    Leakage through gaps is in inverse proportion to the viscosity: where the oil is warmer than reported, what leaks is
    taken for wear by as much as the viscosity is lower.

    Args:
        temperature: as reported [K]; NaN if it is unknown.
    """
    if not math.isfinite(temperature):
        return math.nan, math.nan
    low, here, high = (math.log(float(oil.viscosity(temperature + by))) for by in (-_KELVINS, 0.0, _KELVINS))
    return (low - high) / (2.0 * _KELVINS), -(low - 2.0 * here + high) / _KELVINS**2


def relief_level(pressed: Pressed) -> Learned | None:
    """Torque at the relief valves over what the description says [1]; None where nothing pressed."""
    levels = []
    for way in pressed.sides:
        found = [press.level for press in pressed.presses if press.way == way]
        levels += [float(np.median([one for one in found if one >= _LEVEL * max(found)]))] if found else []
    return Learned(float(np.mean(levels)), _PRESS_STD / math.sqrt(len(levels))) if levels else None


class Counted:
    """What is counted of a log and its track, piece by piece."""

    def __init__(self, unit: HydraulicUnit) -> None:
        self.digest, self.pressed = hashlib.sha256(), Pressed(unit)
        self.passed, self.faults = PassedTime(), FaultNames()
        self.samples = self.usable = self.switched = 0
        self.worked, self.first = 0.0, math.nan
        self._turning = TURNING * unit.max_speed
        self._oil: list[Array] = []
        self._passed = 0.0

    def take(self, piece: Signals, tracked: Signals) -> None:
        """Count a piece."""
        columns = [piece[name].values for name in _COLUMNS]
        time, speed, _, oil = columns
        for name in sorted(piece.names):
            self.digest.update(name.encode() + np.ascontiguousarray(piece[name].values).tobytes())
        self.digest.update(np.ascontiguousarray(time).tobytes())
        if not len(time):
            return
        self.first = float(time[0]) if math.isnan(self.first) else self.first
        passed = self.passed.append(time)
        turns = np.abs(speed) > self._turning
        self.worked += float(np.sum(np.diff(passed, prepend=self._passed)[turns]))
        self._passed = float(passed[-1])
        self.samples += len(time)
        usable = ~is_invalid(tracked["status"].values) & np.isfinite(tracked["position"].values)
        self.usable += int(usable.sum())
        if "reference" in piece:
            self.switched += len(true_intervals(np.isfinite(piece["reference"].values)))
        self._oil.append(oil[np.isfinite(oil)])
        self.faults.append(tracked)
        self.pressed.take(*columns)

    @property
    def oil(self) -> tuple[float, float, float]:
        """Lowest, mean and highest temperature of the oil [K]; NaN where none was reported."""
        known = np.concatenate(self._oil) if self._oil else np.empty(0)
        return (float(known.min()), float(known.mean()), float(known.max())) if known.size else (math.nan,) * 3


def summary(record: Record) -> str:
    """A record in a line."""
    from ramsight.histories.record import shown

    if record.mistake:
        return f"{record.file}: {shown(record.begun)}, cannot be this machine's: {record.mistake}"
    said = ", ".join(f"{name} {value_text(one)}" for name, one in evident(record.quantities).items())
    return f"{record.file}: {shown(record.begun)}, {record.references} references; {said or 'nothing was learned'}"


def evident(quantities: Mapping[str, Learned]) -> dict[str, tuple[float, float]]:
    """What a log alone says, of the quantities that it says something of: value and standard deviation [1]."""
    return {name: found for name, one in quantities.items() if (found := one.evidence) is not None}


def value_text(found: tuple[float, float]) -> str:
    """A value with its standard deviation."""
    return f"{found[0]:.3f} ± {found[1]:.3f}"
