"""Sensors and plants for other runtimes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ramsight.api.machines import AnyMachine, load_machine, only_unit
from ramsight.deploy.c_folder import STEPS, WrittenSensor, write_sensor
from ramsight.deploy.fmu import WrittenFmu, write_fmu
from ramsight.machine.description import Machine
from ramsight.progress import progress as progress_bar


def export_c(
    machine: AnyMachine,
    unit: str | None = None,
    *,
    out: str | Path,
    single: bool = False,
    compiler: str | None = None,
    progress: bool = False,
) -> WrittenSensor:
    """Write the kalman sensor of a unit as C99 for an electronic control unit.

    Args:
        machine: a machine, its name or file.
        unit: name of the unit; may be left out where there is only one.
        out: the folder; made if it is not there, files of an earlier export are replaced.
        single: floats in place of doubles.
        compiler: path of the C compiler that measures it; by default the one that is found, "" for none.
        progress: show a bar on a terminal if it takes long.

    Returns:
        The folder, the names of its files, the compiler, and what it takes of memory [bytes] and time [s].

    Raises:
        DescriptionError: the machine cannot be read, or has several units and none is named.
        UnknownNameError: no such machine or unit.
        OutputError: the folder cannot be written.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     done = ramsight.export_c("mining-loader", "boom", out=f"{folder}/boom-c", compiler="")
        >>> "ramsight_boom.c" in done.files
        True
    """
    described, name = _unit_of(machine, unit)
    with progress_bar(STEPS, "exporting") as bar:
        advance = bar.advance if progress else lambda count: None
        return write_sensor(described, name, out, single=single, compiler=compiler, advance=advance)


def export_fmu(
    machine: AnyMachine,
    unit: str | None = None,
    *,
    out: str | Path,
    what: str = "sensor",
    fmi: int = 2,
    compiler: str | None = None,
    named: Callable[[str], str] = str,
) -> WrittenFmu:
    """Write a co-simulation FMU of a unit's kalman sensor, or of the unit itself.

    Args:
        machine: a machine, its name or file.
        unit: name of the unit; may be left out where there is only one.
        out: the file, `.fmu`.
        what: ``sensor`` or ``plant``.
        fmi: 2 or 3.
        compiler: path of the C compiler; by default the one that is found. Without one, "", it has sources alone.
        named: what errors call an argument.

    Returns:
        The file, its number of variables, and the platform of its binary.

    Raises:
        DescriptionError: there is no such FMU, or the machine has several units and none is named.
        UnknownNameError: no such machine or unit.
        OutputError: the file cannot be written.

    Example:
        >>> import ramsight, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     done = ramsight.export_fmu("mining-loader", "boom", out=f"{folder}/boom.fmu", compiler="")
        >>> done.path.name, done.variables > 20
        ('boom.fmu', True)
    """
    described, name = _unit_of(machine, unit)
    return write_fmu(described, name, out, what=what, fmi=fmi, compiler=compiler, named=named)


def _unit_of(machine: AnyMachine, unit: str | None) -> tuple[Machine, str]:
    """The description, and the name of the unit that is meant."""
    described = load_machine(machine)
    return described, unit or only_unit(described)
