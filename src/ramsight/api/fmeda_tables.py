"""FMEDA tables of virtual sensors, and the diagnostic coverage that follows from one."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from ramsight.api.arguments import path_argument
from ramsight.argument_kinds import by_kind
from ramsight.deploy.diagnostic_coverage import CoverageTable, read_table
from ramsight.deploy.fmeda import fmeda_table
from ramsight.output import check_target, write_text
from ramsight.plant.build import AnyUnit, build


@by_kind
def export_fmeda(machine: AnyUnit, unit: str | None = None, *, out: str | Path) -> int:
    """Write the faults of a unit's virtual sensor, what detects them, and how surely, as a table to fill in.

    Args:
        machine: the unit, or what `build` makes one of.
        unit: name of the unit; may be left out where there is only one.
        out: the file, `.csv`. The column ``failure_rate_fit`` is empty.

    Returns:
        How many faults there are.

    Raises:
        DescriptionError: the machine cannot be read, or has several units and none is named.
        UnknownNameError: no such machine or unit.
        OutputError: the file cannot be written.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     ramsight.export_fmeda("press", out=f"{folder}/press.csv") > 20
        True
    """
    target = path_argument(out, "out")
    check_target(target, (".csv",))
    text = fmeda_table(build(machine, unit))
    write_text(text, target)
    return len(list(csv.reader(io.StringIO(text)))) - 1


@by_kind
def diagnostic_coverage(file: str | Path) -> CoverageTable:
    """Read a table of `export_fmeda` in which failure rates are filled in.

    Args:
        file: CSV with commas, or with semicolons and decimal commas.

    Returns:
        The rows, and the diagnostic coverage `by_channel`, `by_signal` and `overall`, each with its lower end.

    Raises:
        LogError: the file cannot be read, or has a share or rate that is impossible.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = Path(folder) / "boom.csv"
        ...     _ = ramsight.export_fmeda("mining-loader", "boom", out=path)
        ...     ramsight.diagnostic_coverage(path).overall.text
        'no failure rate'
    """
    return read_table(path_argument(file, "file"))
