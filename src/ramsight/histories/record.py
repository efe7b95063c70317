"""What one log says of a machine: a record of its history, and what of it is evidence.

The sensor's estimate of a quantity after a log joins what the log says and what the description says before it. Records
share that prior, so a trend takes what the log alone says. Of a normal prior N(m0, s0^2) and posterior N(m, s^2) it is

    1/r^2 = 1/s^2 - 1/s0^2,    z/r^2 = m/s^2 - m0/s0^2
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ramsight.machine.description import Machine

LEARNED_LEAST = 0.05
"""Least information of a log over that of the description [1] with which it counts: below, it says next to nothing."""


@dataclass(frozen=True)
class Learned:
    """A quantity after one log."""

    value: float  # estimate [1], over that of the description if it is a factor
    std: float  # its standard deviation [1]
    prior: float = 1.0  # what the description says [1]
    prior_std: float = math.inf  # standard deviation of that [1]; infinite if it says nothing

    @property
    def evidence(self) -> tuple[float, float] | None:
        """Value and standard deviation by the log alone [1]; None if it says next to nothing.

        Example:
            >>> [round(one, 3) for one in Learned(1.16, 0.04, 1.0, 0.2).evidence]
            [1.167, 0.041]
            >>> Learned(1.16, 0.199, 1.0, 0.2).evidence is None
            True
        """
        if not (math.isfinite(self.value) and 0.0 < self.std < math.inf):
            return None
        before = self.prior_std**-2
        more = self.std**-2 - before
        if more <= LEARNED_LEAST * before:
            return None
        return (self.value / self.std**2 - self.prior * before) / more, more**-0.5


@dataclass(frozen=True)
class Record:
    """What one log says of a unit."""

    log_digest: str  # of its samples, SHA-256: the same log is one record, whatever its file is called
    file_digest: str  # of the file's bytes, SHA-256
    file: str  # its name
    begun: float  # when the log begins [s since 1970, UTC]
    dated_by: str  # what says so: ``option``, ``log``, ``name``, ``file`` or ``clock``
    duration: float  # of the log [s]
    worked: float  # how long its motor turned [s]
    # oil_low, oil_high, oil_mean: the oil's temperature [K]
    oil_low: float
    oil_high: float
    oil_mean: float
    leak_per_kelvin: float  # change of the logarithm of a leak factor if the oil is warmer than reported [1/K]
    leak_per_kelvin2: float  # derivative of that [1/K^2]
    references: int  # ends and switches that were met
    available: float  # share of the samples whose position may be used [1]
    consistency: float  # mean of the last squared innovations over their variances [1]; 1 of the described machine
    mistake: str = ""  # why the log cannot be this machine's; empty where it can
    faults: tuple[str, ...] = ()  # of inputs that were named
    quantities: Mapping[str, Learned] = field(default_factory=dict)  # that were learned, by name
    covariances: Mapping[str, float] = field(default_factory=dict)  # of their estimates, ``"leak displacement"`` [1]


@dataclass(frozen=True)
class MachineKey:
    """Whose history it is."""

    machine: str  # name of the description
    unit: str  # name of the unit
    serial: str = ""  # serial number of the machine; empty where there is one of its kind

    @property
    def text(self) -> str:
        """As messages have it."""
        return f"{self.machine}, {self.unit}" + (f", {self.serial}" if self.serial else "")


_NO_FACTOR_RESTS_ON = {"requirement", "tolerances"}


def description_digest(machine: Machine, unit: str) -> str:
    """SHA-256 of all of a description that the learned quantities of a unit are relative to.

    What the position is required for, tolerances, titles and sources may change; a number of the machine may not.

    Example:
        >>> import ramsight
        >>> loader = ramsight.load_machine("mining-loader")
        >>> other = loader.replace({"units.boom.cylinder.bore": "161 mm"})
        >>> description_digest(loader, "boom") == description_digest(other, "boom")
        False
        >>> description_digest(loader, "bucket") == description_digest(other, "bucket")
        True
    """
    text = machine.unit(unit).model_dump_json(exclude=_NO_FACTOR_RESTS_ON)
    return hashlib.sha256(text.encode()).hexdigest()
