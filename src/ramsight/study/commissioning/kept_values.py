"""What is kept of a commissioning, and what a later one finds changed."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ramsight._version import __version__
from ramsight.calibration.identify import Identification
from ramsight.calibration.leakage import LeakTest
from ramsight.calibration.loss_uncertainty import THERMOMETER
from ramsight.errors import DescriptionError
from ramsight.machine.as_toml import as_toml
from ramsight.normal import TWO_SIDED_95
from ramsight.output import write_text
from ramsight.signals import Dataset
from ramsight.study.commissioning.finding import Finding, Verdict

if TYPE_CHECKING:
    from ramsight.machine.description import Machine

FORMAT = 1
LARGEST = 16_000_000
"""Bytes of a file that is read."""
_KIND = "ramsight commissioning"
_IDENTIFIED = ("leak", "displacement", "stiffness", "friction")
_LEARNED = ("leak", "displacement", "compliance")


@dataclass(frozen=True)
class Measured:
    """A value over that of the description [1], and its standard deviation [1]."""

    value: float
    std: float


@dataclass(frozen=True)
class Kept:
    """What is kept of a commissioning."""

    machine: str
    unit: str
    made: str  # when, as ISO 8601
    description: str  # TOML of the machine by which the next one is judged
    values: Mapping[str, Measured]  # over those of that description, by name

    def write(self, path: Path) -> None:
        """Write it as JSON.

        Raises:
            OutputError: it cannot be written.
        """
        content = {"kind": _KIND, "format": FORMAT, "version": __version__, **asdict(self)}
        write_text(json.dumps(content, indent=1) + "\n", path)


def read_kept(path: Path) -> Kept:
    """What was kept of an earlier commissioning.

    Args:
        path: a file of `Kept.write`.

    Raises:
        DescriptionError: it is none, or of a later format.
    """
    file = str(path)
    try:
        with path.open("rb") as stream:
            content = json.loads(stream.read(LARGEST + 1)[:LARGEST])
    except (OSError, ValueError, RecursionError) as error:
        raise DescriptionError(f"cannot be read: {' '.join(str(error).split())}", file=file) from None
    if not isinstance(content, dict) or content.get("kind") != _KIND:
        raise DescriptionError("holds no commissioning", file=file, allowed="what ramsight commission --keep writes")
    if content.get("format") != FORMAT:
        raise DescriptionError(
            "is of another format", file=file, key="format", value=content.get("format"), allowed="1"
        )
    texts = [content.get(name) for name in ("machine", "unit", "made", "description")]
    if not all(isinstance(one, str) for one in texts) or not isinstance(content.get("values"), dict):
        raise DescriptionError("is not whole", file=file)
    machine, unit, made, description = map(str, texts)
    try:
        datetime.fromisoformat(made)
    except ValueError:
        raise DescriptionError("is no time", file=file, key="made", value=made, allowed="as ISO 8601 has it") from None
    values = {str(name): _measured(file, str(name), one) for name, one in content["values"].items()}
    return Kept(machine, unit, made, description, values)


def _measured(file: str, name: str, one: Any) -> Measured:
    numbers: list[Any] = [one.get(key) for key in ("value", "std")] if isinstance(one, dict) else []
    # A comparison, because a whole number of JSON may be larger than any float.
    finite = [n for n in numbers if isinstance(n, int | float) and abs(n) <= sys.float_info.max]
    if len(finite) != 2 or finite[1] < 0.0:
        raise DescriptionError("is no value with its standard deviation", file=file, key=f"values.{name}", value=one)
    return Measured(float(finite[0]), float(finite[1]))


def described_as(machine: Machine) -> str:
    """A machine's description as TOML, with its sources."""
    return "\n".join(as_toml(machine, machine.sources)).strip() + "\n"


def measured(
    track: Dataset | None, test: LeakTest | None, identification: Identification | None
) -> dict[str, Measured]:
    """What a commissioning measured of a machine, over the description that it was judged by."""
    found = {}
    if test is not None:
        found["leak test"] = Measured(test.factor, math.hypot(test.std, THERMOMETER * test.per_kelvin))
    for name in _IDENTIFIED if identification is not None else ():
        one = identification.factors[name]  # type: ignore[union-attr]
        if one.identified:
            found[f"identified {name}"] = Measured(one.value, math.hypot(one.std, THERMOMETER * one.per_kelvin))
    for name in _LEARNED if track is not None else ():
        value, std = (float(track[f"{name}_factor{end}"][-1]) for end in ("", "_std"))  # type: ignore[index]
        if math.isfinite(value) and math.isfinite(std):
            found[f"learned {name}"] = Measured(value, std)
    return found


def over(values: Mapping[str, Measured], tuned: Identification) -> dict[str, Measured]:
    """The same values over those of the description that was tuned by what was identified.

    Where no leakage through gaps was identified, values of the leakage are left out: nothing can be over zero.
    """
    factor = {name: one.value if one.identified else 1.0 for name, one in tuned.factors.items()}
    factor["compliance"] = 1.0 / factor["stiffness"]
    factor["test"] = factor["leak"]
    by = {name: factor[name.rpartition(" ")[2]] for name in values}
    return {name: Measured(one.value / by[name], one.std / by[name]) for name, one in values.items() if by[name] > 0.0}


def kept_of(machine: Machine, unit: str, made: datetime, values: Mapping[str, Measured]) -> Kept:
    """What is kept of a commissioning."""
    return Kept(machine.name, unit, made.isoformat(timespec="seconds"), described_as(machine), values)


_SURE = 3.0
"""Deviations from which a change is one: of ten values, one in forty second commissionings has one by chance."""
_LEAST = 1e-6  # of a deviation, so that equal values of a file that was changed divide by something
_SAYS = {
    "leak": ("the pumps have worn, or the oil is thinner than described", "the pumps leak less: were they replaced?"),
    "displacement": ("more oil a turn: was a pump or a belt replaced?", "less oil a turn: look for air at the suction"),
    "stiffness": ("stiffer: was a hose or the oil replaced?", "softer: look for air in the oil, and at the hoses"),
    "compliance": ("softer: look for air in the oil, and at the hoses", "stiffer: was a hose or the oil replaced?"),
    "friction": ("look at seals and guides of the cylinder", "less friction: were seals replaced?"),
}
"""What more and less of a value means."""


@dataclass(frozen=True)
class Change:
    """One value then and now, over that of the description [1]."""

    name: str  # what it is
    # then, now: with their standard deviations
    then: Measured
    now: Measured

    @property
    def change(self) -> float:
        """Now less then [1]."""
        return self.now.value - self.then.value

    @property
    def deviations(self) -> float:
        """The change over its standard deviation [1]."""
        return self.change / max(math.hypot(self.then.std, self.now.std), _LEAST)

    @property
    def is_sure(self) -> bool:
        """Whether it is more than chance."""
        return abs(self.deviations) > _SURE

    @property
    def cells(self) -> tuple[str, str, str, str, str]:
        """A row of the table."""
        then, now = (f"{one.value:.3f} ± {TWO_SIDED_95 * one.std:.3f}" for one in (self.then, self.now))
        return self.name, then, now, f"{self.change:+.3f}", f"{self.deviations:+.1f}"

    @property
    def says(self) -> str:
        """What the change means."""
        of = "leak" if self.name == "leak test" else self.name.rpartition(" ")[2]
        return _SAYS[of][0 if self.change > 0.0 else 1]


HEAD = ("over the description", "then", "now", "change", "over its deviation")


def changes(kept: Kept, now: Mapping[str, Measured]) -> tuple[Change, ...]:
    """What both commissionings measured."""
    return tuple(Change(name, then, now[name]) for name, then in kept.values.items() if name in now)


def changed(kept: Kept, found: Sequence[Change]) -> Finding:
    """Whether something has changed, as a finding."""
    if not found:
        remedy = "commission with a leak test, and with a measured position as before"
        return Finding("changes", Verdict.OPEN, f"nothing was measured both now and on {kept.made}", remedy)
    sure = [one for one in found if one.is_sure]
    if not sure:
        largest = max(found, key=lambda one: abs(one.deviations))
        said = f"the largest of {len(found)} is {largest.name}, {largest.deviations:+.1f} deviations"
        return Finding("changes", Verdict.PASSED, f"none since {kept.made}; {said}")
    said = ", ".join(f"{one.name} {100 * one.change:+.1f} % ({one.deviations:+.1f} deviations)" for one in sure)
    first = max(sure, key=lambda one: abs(one.deviations))
    return Finding("changes", Verdict.LOOK_TWICE, f"since {kept.made}: {said}", first.says)


def table_text(found: Sequence[Change]) -> str:
    """The changes as a table of text, "" if there are none."""
    if not found:
        return ""
    rows = [HEAD, *(one.cells for one in found)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(HEAD))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )
