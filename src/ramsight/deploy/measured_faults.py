"""What the study of faults has measured: how many of each fault were detected, and how soon.

The rows are those of the tables of docs/integrity.md and docs/safety.md. They hold for simulated work days of machines
drawn at random around the data sheets of the mining loader's boom and bucket.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from ramsight.sensor.report.detectors import COUNTER, POWER, PRESSURES

MEASURED_ON = "simulated work days of machines drawn around the data sheets of mining-loader's boom and bucket"
"""What the shares were measured on."""
REAL_TOLERANCE, REAL_ALERT = 1e-3, 0.2
"""Tolerance [m] and time to alert [s] with which faults of a real sensor were compared."""
_SETS = (
    (frozenset({COUNTER, POWER}), "+ counter and DC power"),
    (frozenset({POWER}), "+ DC power"),
    (frozenset({COUNTER}), "+ counter"),
    (frozenset({PRESSURES}), "+ pressures"),
    (frozenset[str](), "speed, torque, temperature"),
)
"""Sets of signals that were measured, the strongest first."""
BOTH = _SETS[0][1]
"""The set of signals with which faults of a real sensor were measured."""


@dataclass(frozen=True)
class MeasuredFault:
    """A fault that was put into a signal, many times."""

    signal: str  # name of the input, `time`, `all`, or `other_position` of a real sensor
    fault: str  # what is wrong with it
    trials: int  # how often it was put in
    detected: int  # how often it was detected
    at_least: float  # lower end of the 95 % interval of that share (Clopper and Pearson)
    delay: float | None  # median time to detection [s]; None if it never was
    # the time that 95 % of the detected ones take at most [s]; None where it was not kept
    delay_95: float | None = None
    # median over the trials of the largest error of the position [m]; None where it was not kept
    error: float | None = None

    @property
    def share(self) -> float:
        """Share that was detected."""
        return self.detected / self.trials


def measured_set(further: Collection[str]) -> str:
    """The strongest set of signals that was measured and that a machine has.

    Args:
        further: what the machine declares beside speed, torque and temperature, by the names of the detectors.

    Example:
        >>> measured_set(["counter", "pressures"])
        '+ counter'
    """
    return next(name for needs, name in _SETS if needs <= set(further))


def measured_faults(given: str) -> tuple[MeasuredFault, ...]:
    """Faults of the signals of a virtual sensor.

    Args:
        given: a set of signals, as `measured_set` gives it.

    Example:
        >>> one = measured_faults("+ counter and DC power")[1]
        >>> one.signal, one.fault, one.detected, one.trials, round(one.at_least, 3)
        ('shaft_angle', 'stuck, 5 s', 160, 160, 0.977)
    """
    return tuple(
        MeasuredFault(signal, fault, trials, detected, at_least, delay, None, 1e-3 * error)
        for signal, fault, trials, detected, at_least, delay, error in _kept()["virtual"][given]
    )


def measured_real_faults() -> tuple[MeasuredFault, ...]:
    """Faults of a real position sensor that is compared with a virtual one, which has counter and DC power."""
    return tuple(_real())


def _real() -> Iterator[MeasuredFault]:
    for fault, trials, detected, at_least, delay, delay_95 in _kept()["real"]:
        yield MeasuredFault("other_position", fault, trials, detected, at_least, delay, delay_95)


@cache
def _kept() -> dict[str, Any]:
    text = (resources.files("ramsight.deploy") / "measured_faults.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found
