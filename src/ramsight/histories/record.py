"""What one log says of a machine: a record of its history, when it was recorded, and what of it is evidence.

The sensor's estimate of a quantity after a log joins what the log says and what the description says before it. Records
share that prior, so a trend takes what the log alone says. Of a normal prior N(m0, s0^2) and posterior N(m, s^2) it is

    1/r^2 = 1/s^2 - 1/s0^2,    z/r^2 = m/s^2 - m0/s0^2
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

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


_DAY = r"(?<!\d)(20\d\d)[-_.]?([01]\d)[-_.]?([0-3]\d)"
_TIME = r"[T _.-]?([0-2]\d)[-_.:h]?([0-5]\d)(?:[-_.:m]?([0-5]\d))?"
_STAMP = re.compile(rf"{_DAY}(?:{_TIME})?(?!\d)")
_CLOCK = (9.4e8, 4.1e9)  # s since 1970, from 1999 to 2099: a time in a log that is a date


def instant(text: str) -> float:
    """A time as ISO 8601 has it [s since 1970]; UTC unless it says otherwise.

    Raises:
        ValueError: it is none.

    Example:
        >>> instant("1970-01-02"), instant("1970-01-01T01:00:00+01:00")
        (86400.0, 0.0)
    """
    found = datetime.fromisoformat(text)
    return (found if found.tzinfo else found.replace(tzinfo=UTC)).timestamp()


def shown(seconds: float) -> str:
    """The day of a time [s since 1970].

    Example:
        >>> shown(86400.0)
        '1970-01-02'
    """
    return datetime.fromtimestamp(seconds, UTC).date().isoformat()


def begun(path: Path, first: float, at: float | None = None) -> tuple[float, str]:
    """When a log begins [s since 1970], and what says so.

    Args:
        first: time of its first sample, by its own clock [s].
        at: when, as it was passed [s since 1970]; None if it was not.

    Example:
        >>> begun(Path("boom_2026-03-01T0630.csv"), 0.0)
        (1772346600.0, 'name')
        >>> begun(Path("boom_20260301.csv"), 1.7e9)
        (1700000000.0, 'log')
    """
    if at is not None:
        return at, "option"
    if math.isfinite(first) and _CLOCK[0] < first < _CLOCK[1]:
        return first, "log"
    named = named_time(path.name)
    return (path.stat().st_mtime, "file") if named is None else (named, "name")


def named_time(name: str) -> float | None:
    """The time in a file's name [s since 1970, UTC]; None if there is none.

    Example:
        >>> named_time("day_2026-02-30.csv") is None, named_time("run 123456.csv") is None
        (True, True)
    """
    for found in _STAMP.finditer(name):
        try:
            year, month, day, hour, minute, second = (int(one or 0) for one in found.groups())
            return datetime(year, month, day, hour, minute, second, tzinfo=UTC).timestamp()
        except ValueError:
            continue
    return None
