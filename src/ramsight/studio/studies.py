"""A data sheet that fills: machines are simulated a few at a time, and after each the accuracy so far is said."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ramsight.api.studying import Study
from ramsight.machine.as_toml import as_toml
from ramsight.machine.description import Machine
from ramsight.studio.job import Say
from ramsight.study.datasheet.sheet import Sheet
from ramsight.study.datasheet.sheet_files import write_sheet

SHEET_SENSORS = ("kalman", "balance", "table")
_FIRST, _STEPS = 8, 20  # machines at first; after that so many times the accuracy so far is said


@dataclass(frozen=True)
class Wanted:
    """A study as a visitor asks for it.

    Attributes:
        machine: its description.
        unit: of it.
        duty, sensor: as `Study` takes them.
        machines: how many.
        seed: of it.
    """

    machine: Machine
    unit: str
    duty: str
    sensor: str
    machines: int
    seed: int = 0

    def folder(self, below: Path) -> Path:
        """Where it is kept: the same study goes on where it was stopped, another one is elsewhere."""
        said = "\n".join([*as_toml(self.machine, {}), self.unit, self.duty, self.sensor, str(self.seed)])
        return below / f"study-{hashlib.sha256(said.encode()).hexdigest()[:16]}"


def fill(say: Say, wanted: Wanted, below: Path) -> None:
    """Do a study; says ``begun`` (its quantities), ``so far`` again and again, and ``written`` (the folder).

    Args:
        say: is passed what becomes of it.
        wanted: the study.
        below: folder that its own is made in.
    """
    out = wanted.folder(below)
    out.mkdir(exist_ok=True)
    whole = _study(wanted, wanted.machines)
    say("begun", whole.quantities)
    for count in steps(wanted.machines):
        study = _study(wanted, count)
        found = study.run(out / "machines.zarr")
        sheet = study.datasheet(found)
        say("so far", so_far(sheet, wanted.machines))
    sheet = whole.datasheet(found, whole.budget(0))
    title = f"{wanted.machine.title or wanted.machine.name}, unit {wanted.unit}"
    write_sheet(sheet, found, out, title)
    say("written", str(out))


def _study(wanted: Wanted, count: int) -> Study:
    return Study(wanted.machine, wanted.duty, wanted.sensor, unit=wanted.unit, machines=count, seed=wanted.seed)


def steps(machines: int) -> list[int]:
    """After how many machines the accuracy so far is said.

    Example:
        >>> steps(100)
        [8, 16, 24, 32, 40, 48, 56, 64, 72, 80, 88, 96, 100]
    """
    step = max(_FIRST, machines // _STEPS)
    return [*range(step, machines, step), machines]


def so_far(sheet: Sheet, wanted: int) -> dict[str, Any]:
    """What a page shows of a sheet that is not full yet: lengths in mm."""
    rows = [
        {
            "errors": one.group,
            "machines": one.machines,
            "95 % within": 1e3 * one.quantiles[1].value,
            "95 % of the machines": 1e3 * one.machine.value,
            "largest": 1e3 * one.largest,
        }
        for one in sheet.accuracy
        if one.machines
    ]
    validity = ", ".join(f"{name} {100.0 * share:.1f} %" for name, share in sheet.validity.items())
    return {"done": sheet.machines, "wanted": wanted, "failed": sheet.failed, "accuracy": rows, "status": validity}
